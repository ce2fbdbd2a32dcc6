"""What a worker needs, loaded once: the process that imports this is copied for every worker."""

import atexit
import os
from importlib import import_module

from finger3d._lazy import loading, postpone

_NAMES = (
    "dask", "numpy", "distributed", "distributed.nanny", "scipy.sparse", "scipy.linalg", "threadpoolctl",
    "finger3d.mechanics.step_halving", "finger3d.analyses.sweep.worker", "finger3d.fem.pardiso",
)  # fmt: skip


def _load() -> None:
    asked = os.getppid()
    for name in _NAMES:
        if os.getppid() != asked:  # a mistake was found in the meantime: nobody will want workers
            os._exit(0)
        import_module(name)
        if name == "numpy":
            postpone("numpy.f2py", "numpy.testing")  # SciPy imports them; no worker uses them
    from finger3d.fem import pardiso

    pardiso.available()  # which loads its library


with loading():
    _load()
# To take all that down in good order would keep waiting whoever reads what the sweep says. Workers do not come here.
atexit.register(os._exit, 0)
