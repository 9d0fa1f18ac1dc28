"""What each part of a run costs: a benchmark suite, and growth with runs and periods.

Every value here is a time or a memory of one machine at one moment, so all of it goes into a file
of timings, and none into files whose bytes are compared.
"""
