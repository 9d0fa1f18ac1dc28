"""`damper.design`: the damper of a machine, sized for the worst case, with what it will do.

`machine` is what an engineer gives, `study` the studies that a damper is judged by, `search` the
optimiser, `answer` the result and its card, `page` its report.
"""
