"""Configuration of JAX: float64, a compilation cache in the user's cache folder, XLA flags for small programs.

Must be imported before any tracing. Settings in the environment take precedence.
"""

import os
import warnings

from nectosome.io.atomic import cache_folder

# XLA's defaults suit large arrays; a robot's are small:
# - Without fusion emitters graphs compile in half the time; with few splits they load faster from the cache.
# - A loop with up to 0.5 MB of data becomes one function. Otherwise each of its kernels goes to a thread pool, which
#   takes longer than the kernel (8 s of a paddle: 50 ms instead of 20 ms). Larger functions compile too slowly.
# - Library matrix products cannot be part of such a function.
_FOR_SMALL_GRAPHS = (
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_cpu_parallel_codegen_split_count=2",
    "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=500000",
    "--xla_cpu_experimental_ynn_fusion_type=",
)


def configure() -> None:
    """Enable float64 and the persistent compilation cache (`NECTOSOME_CACHE` sets its folder, empty disables it).

    A folder that others can write to is not used, with a warning: what is in it is run.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    new = (flag for flag in _FOR_SMALL_GRAPHS if flag.partition("=")[0] not in flags)
    os.environ["XLA_FLAGS"] = " ".join([flags, *new]).strip()
    # Errors are raised anyway; XLA's messages ask users to report compilations over two minutes.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

    import jax

    import nectosome.core.programs.program_files as program_files  # after the settings, since it imports JAX

    jax.config.update("jax_enable_x64", True)
    folder = cache_folder()
    if folder and "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        if why := program_files.why_refused(folder):
            warnings.warn(f"programs are compiled anew and not kept: {why}.", stacklevel=2)
            return
        program_files.take_over()
        jax.config.update("jax_compilation_cache_dir", str(folder / "xla"))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


configure()
