"""Where JAX computes, decided before it starts."""

import os
from typing import Literal

from touchdown.errors import UserError, one_line

Device = Literal["cpu", "gpu"]

_ONE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


_chosen: list[Device] = []


def chosen() -> Device:
    """The device in use, or the one that will be."""
    return _chosen[-1] if _chosen else "cpu"


def use_default() -> None:
    """Have JAX compute on the CPU, unless a device was chosen before."""
    if not _chosen:
        use("cpu")


def use(device: Device) -> None:
    """Have JAX compute on one kind of device.

    On the CPU it gets one thread, which is the fastest for networks of this size and leaves the
    other cores to other runs. It has no effect on a JAX that has computed something already.

    Raises:
        UserError: there is no such device here.
    """
    if device not in ("cpu", "gpu"):
        raise UserError(f"device {device!r}: must be cpu or gpu")
    flags = os.environ.get("XLA_FLAGS", "")
    if _ONE_THREAD not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {_ONE_THREAD}".strip()
    import jax  # noqa: PLC0415 - it reads XLA_FLAGS when it starts

    jax.config.update("jax_platforms", "cpu" if device == "cpu" else None)
    # handing each small call to another thread costs more than the call
    jax.config.update("jax_cpu_enable_async_dispatch", False)  # noqa: FBT003
    try:
        jax.devices(device)
    except RuntimeError as error:
        raise UserError(
            f"device {device!r}: JAX finds none here ({one_line(error)}); "
            "use cpu, or install JAX for your GPU"
        ) from None
    _chosen.append(device)
