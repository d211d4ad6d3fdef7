"""Functional mock-up units (FMI 2.0 and 3.0, co-simulation) behind the plant kind ``fmu``.

A `Worker` holds one FMU: it checks the archive before anything is extracted, describes the model,
and steps it through FMPy. It knows no transport: ``python -m twinrig._fmu`` serves one over pipes,
so that an FMU that crashes or hangs ends its own process only; with ``isolated = false`` the native
half calls one in its own process.
"""
