"""Settings of the process: one BLAS thread, defaults of NumPy, time limits, the version."""
