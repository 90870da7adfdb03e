"""How JAX runs here: float64, a compilation cache in the user's cache folder, small programs on the CPU.

Imported before anything that traces. Settings a user has made in the environment are left as they are.
"""

import os
from pathlib import Path

# XLA is made for large arrays, a robot's are small:
# - Without fusion emitters graphs compile in half the time; in few pieces they load sooner from the cache.
# - A loop that moves up to 0.5 MB becomes one function. Else each of its kernels is handed to a pool of threads, which
#   takes longer than the kernel: a paddle's 8 s took 50 ms, and take 20. Larger functions take too long to compile.
# - Products by a library cannot be part of such a function.
_FOR_SMALL_GRAPHS = (
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_cpu_parallel_codegen_split_count=2",
    "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=500000",
    "--xla_cpu_experimental_ynn_fusion_type=",
)


def configure() -> None:
    """Switch on float64 and the persistent compilation cache (`NECTOSOME_CACHE` moves it, empty switches it off)."""
    flags = os.environ.get("XLA_FLAGS", "")
    new = (flag for flag in _FOR_SMALL_GRAPHS if flag.partition("=")[0] not in flags)
    os.environ["XLA_FLAGS"] = " ".join([flags, *new]).strip()
    # What goes wrong is raised; XLA's own lines on stderr ask users to report compilations that take two minutes.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

    import jax
    from platformdirs import user_cache_dir

    jax.config.update("jax_enable_x64", True)
    folder = os.environ.get("NECTOSOME_CACHE", user_cache_dir("nectosome"))
    if folder and "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(Path(folder) / "xla"))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


configure()
