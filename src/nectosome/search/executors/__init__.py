"""Where work is spread: calls through any executor, our own processes, a Dask cluster, and shares without either.

`spread` hands calls to an executor and results back; `processes` and `cluster` are executors; `afar` runs starts whose
evaluations an executor makes; `shares` joins what was computed apart. All of them go on after a kill.
"""
