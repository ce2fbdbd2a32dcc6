"""What a worker needs, loaded once: the process that imports this is copied for every worker."""

import atexit
import gc
import os
from importlib import import_module

_NAMES = (
    "dask", "numpy", "distributed", "distributed.nanny", "scipy.sparse", "scipy.linalg", "threadpoolctl",
    "finger3d.increments", "finger3d.sweep.work", "finger3d.fem.pardiso",
)  # fmt: skip


def _load() -> None:
    asked = os.getppid()
    for name in _NAMES:
        if os.getppid() != asked:  # a mistake was found in the meantime: nobody will want workers
            os._exit(0)
        import_module(name)
    from finger3d.fem import pardiso

    pardiso.available()  # which loads its library


gc.disable()
_load()
gc.freeze()  # no worker need look through it for what its presses leave
gc.enable()
# To take all that down in good order would keep waiting whoever reads what the sweep says. Workers do not come here.
atexit.register(os._exit, 0)
