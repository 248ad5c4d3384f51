"""What other programs call our settings and flags, to answer those who type their names."""

from collections.abc import Collection, Mapping

FLAGS: Mapping[str, tuple[str, ...]] = {
    "lr": ("learning-rate",),
    "step-size": ("learning-rate",),
    "timesteps": ("max-env-steps", "env-steps"),
    "total-timesteps": ("max-env-steps", "env-steps"),
    "max-timesteps": ("max-env-steps", "env-steps"),
    "total-steps": ("max-env-steps", "env-steps"),
    "num-steps": ("max-env-steps", "env-steps"),
    "max-steps": ("max-env-steps", "env-steps"),
    "steps": ("max-env-steps", "env-steps"),
    "n-envs": ("num-envs",),
    "envs": ("num-envs",),
    "env": ("env-id",),
    "environment": ("env-id",),
    "n-episodes": ("episodes",),
    "num-episodes": ("episodes",),
    "discount": ("gamma",),
    "discount-factor": ("gamma",),
    "tau": ("polyak",),
    "buffer-size": ("capacity",),
    "memory-size": ("capacity",),
    "replay-size": ("capacity",),
    "learning-starts": ("min-size",),
    "warmup": ("min-size",),
    "train-freq": ("update-period",),
    "train-frequency": ("update-period",),
    "target-update-interval": ("target-period",),
    "target-network-frequency": ("target-period",),
    "net-arch": ("hidden-sizes",),
    "layers": ("hidden-sizes",),
    "hidden": ("hidden-sizes",),
    "n-steps": ("n-step",),
    "handle-timeout-termination": ("bootstrap-on-time-limit",),
    "nstep": ("n-step",),
    "epsilon": ("epsilon-start",),
    "eps": ("epsilon-start",),
    "start-e": ("epsilon-start",),
    "end-e": ("epsilon-end",),
    "exploration-fraction": ("epsilon-duration",),
    "grad-clip": ("max-grad-norm",),
    "track": ("logger",),
    "log": ("logger",),
    "gpu": ("device gpu",),
    "cuda": ("device gpu",),
    "cpu": ("device cpu",),
    "window": ("out window",),
    "render": ("out window",),
    "output": ("out",),
    "overwrite": ("force",),
    "run-name": ("name",),
    "n-seeds": ("seeds",),
    "num-seeds": ("seeds",),
    "n-trials": ("trials",),
    "num-trials": ("trials",),
    "jobs": ("workers",),
    "n-jobs": ("workers",),
    "num-workers": ("workers",),
}
"""Flags by what they are called elsewhere, each with what to type; the first that exists counts."""

OTHER_ALGORITHMS = frozenset(("ppo", "a2c", "a3c", "sac", "td3", "ddpg", "trpo", "reinforce"))
"""Algorithms of other libraries that learn no action values."""


def flag_for(name: str, flags: Collection[str]) -> str | None:
    """What to type for a flag or setting that other programs call `name`; None if nothing.

    Args:
        name: such as `lr` or `n_envs`.
        flags: those that exist, such as `learning-rate`.
    """
    meant = FLAGS.get(name.replace("_", "-"), ())
    return next((typed for typed in meant if typed.split()[0] in flags), None)
