"""How JAX runs here: float64, a compilation cache in the user's cache folder, quick compilation on the CPU.

Imported before anything that traces. Settings a user has made in the environment are left as they are.
"""

import os
from pathlib import Path

# Without fusion emitters the small graphs of a robot compile in half the time; in few pieces they load sooner from the
# cache. Run time is the same within noise: residual 31 us, its Jacobian 420 us either way.
_QUICK_START = ("--xla_cpu_use_fusion_emitters=false", "--xla_cpu_parallel_codegen_split_count=2")


def configure() -> None:
    """Switch on float64 and the persistent compilation cache (`NECTOSOME_CACHE` moves it, empty switches it off)."""
    flags = os.environ.get("XLA_FLAGS", "")
    new = (flag for flag in _QUICK_START if flag.partition("=")[0] not in flags)
    os.environ["XLA_FLAGS"] = " ".join([flags, *new]).strip()

    import jax
    from platformdirs import user_cache_dir

    jax.config.update("jax_enable_x64", True)
    folder = os.environ.get("NECTOSOME_CACHE", user_cache_dir("nectosome"))
    if folder and "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(Path(folder) / "xla"))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


configure()
