"""What each part of the software costs, measured: time, memory, imports, jobs.

`paired` takes turns with a clock, `process` does things in interpreters of their own. With them,
`ladder` measures scenes and observers against the bare engine, `without` what a feature costs a
scene that does not use it, `scaling` lanes and periods, `startup` the imports of each kind of job,
`jobs` how many jobs a target needs, `benchmarks` what jobs took; `measure` runs all of it. Nothing
else imports any of this but the last, with which the workflow says what a run took.

Every value here is a measurement of one machine at one time, and none is the same twice: what is
written of it goes into a file of timings of its own.
"""
