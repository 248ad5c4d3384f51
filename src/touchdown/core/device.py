"""Selects the device that JAX computes on, before JAX starts."""

import os
from typing import Any, Literal

from touchdown.core import cache
from touchdown.core.errors import UserError, one_line

Device = Literal["cpu", "gpu"]

_ONE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

_chosen: list[Device] = []
_started_in: list[int] = []  # the process in which JAX started


def chosen() -> Device:
    """The device in use, or the one that will be used."""
    return _chosen[-1] if _chosen else "cpu"


def _keep_compilations(config: Any) -> None:
    """Make JAX cache compiled code on disk for later runs of this user."""
    if os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        return
    folder = cache.folder("jax")
    if folder is None:
        return  # JAX is only slower
    config.update("jax_compilation_cache_dir", str(folder))
    config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def use_default() -> None:
    """Make JAX compute on the CPU, unless a device was already selected."""
    if not _chosen:
        use("cpu")


def use(device: Device) -> None:
    """Select the device that JAX will compute on; the CPU is not started before it is used.

    On the CPU JAX uses one thread, which is fastest for networks of this size and leaves the other
    cores to other runs. The selection has no effect once JAX has computed something.

    Raises:
        UserError: this machine has no such device, or this process is a fork (see `start`).
    """
    if device not in ("cpu", "gpu"):
        raise UserError(f"device {device!r}: must be cpu or gpu")
    flags = os.environ.get("XLA_FLAGS", "")
    if _ONE_THREAD not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {_ONE_THREAD}".strip()
    if device == "gpu" or _started_in:
        _start(device)
    _chosen.append(device)


def start() -> None:
    """Start JAX on the device in use, once; call it before anything is computed.

    Raises:
        UserError: this machine has no such device, or this process is a fork of one that had
            started JAX: JAX computes on threads, which a fork does not copy, and would hang.
    """
    if _started_in:
        _check_process()
    else:
        use_default()
        _start(chosen())


def _start(device: Device) -> None:
    import jax  # noqa: PLC0415 - it reads XLA_FLAGS when it starts, and takes a second to load

    if _started_in:
        _check_process()
    else:
        jax.config.update("jax_platforms", "cpu" if device == "cpu" else None)
        _keep_compilations(jax.config)
        # passing each small call to another thread costs more than the call
        jax.config.update("jax_cpu_enable_async_dispatch", False)  # noqa: FBT003
        _started_in.append(os.getpid())
    try:
        jax.devices(device)
    except RuntimeError as error:
        raise UserError(
            f"device {device!r}: JAX finds no such device ({one_line(error)}); "
            "use cpu, or install JAX for your GPU"
        ) from None


def _check_process() -> None:
    if _started_in[0] != os.getpid():
        raise UserError(
            "this process was forked after JAX had started, and networks would hang in it: start "
            "processes by multiprocessing.get_context('spawn'), or before using a network"
        )
