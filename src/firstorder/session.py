"""Settings of a program, made once at its start: precision, a sound compiler, a cache of code.

`import firstorder` sets no JAX flag. A script, a notebook or the command line calls `start` in its
first lines; a library that builds on this one leaves that choice to its own users.
"""

import gc
import os
import uuid
import warnings
from collections.abc import Mapping
from pathlib import Path

import jax
import jaxlib
from jax.experimental.compilation_cache import compilation_cache

OFF = "off"

# New objects after which Python looks for cycles among them; by itself after 700, or 2,000.
OBJECTS = 10_000

# What `start` was asked for, call by call; empty where nobody has called it.
_started: list[bool] = []

# The flag without which sums are wrong.
SOUND = "--xla_cpu_experimental_ynn_fusion_type"

# Flags of XLA for CPUs, each with the versions of jaxlib that it is meant for: from the first, and
# before the second. XLA ends a program that names a flag it does not know.
FLAGS = (
    # From 0.10.2 on sums of products are fused in a way that gives wrong numbers where one factor
    # is broadcast (jax issue 39103; tests/test_session.py has seven lines that show it). This
    # turns that fusion off. The older emitter below has the same fault, so both flags are needed.
    (SOUND, "", (0, 10, 2), (0, 13)),
    # The older emitter of loops compiles 2 to 2.5 times as fast, and what it compiles runs as
    # fast. Versions from 0.8 to 0.11.0 were seen to have it; 0.11.1 has it no more.
    ("--xla_cpu_use_fusion_emitters", "false", (0, 8), (0, 11, 1)),
    # Our functions are small: splitting one over several threads costs more than it saves.
    ("--xla_cpu_parallel_codegen_split_count", "1", (0, 8), (0, 11, 1)),
)

# How hard XLA works on what it compiles, which every version knows; 3 unless a program says else.
EFFORT = "--xla_backend_optimization_level"


def start(
    *, x64: bool = True, cache: str | os.PathLike[str] | None = None, optimize: bool = True
) -> Path | None:
    """Turns on float64, a sound and quick compiler, and the cache of compiled functions.

    jaxlib 0.10.2 to 0.12 return wrong sums on CPUs unless a flag is set (`XLA_FLAGS`), and read it
    at the first use of a device. A program that does without `start` sets it itself:
    `XLA_FLAGS=--xla_cpu_experimental_ynn_fusion_type=`. Two more flags halve the time of
    compilation up to jaxlib 0.11.0 (see `FLAGS`). An accelerator keeps all bits of the factors of a
    float32 matrix product (`jax_default_matmul_precision`); by itself it drops 13 of 24.

    Python's search for objects that hold each other runs once in 10,000 new ones (`gc`), unless it
    ran more seldom before. While JAX traces a function it makes a hundred thousand, and the search
    takes a third of that time.

    Each new derivative takes JAX some 0.3 to 2 s to compile, and a process forgets it when it
    ends. The cache keeps every compiled function, however small and however quickly compiled, so
    that a second run of the same program starts at once. Several processes may share one folder,
    each may be killed at any time, and deleting the folder is always safe.

    To look around, `optimize=False` compiles without optimisation: a first answer of a new kind is
    there in half the time, and later ones take longer (`benchmarks/first_calls.md` has both).

    Valid when: called before the first array is made, as arrays keep the precision they were made
    with. Wrong when: called by a library, as the flags are global to the process.

    Args:
        x64: whether arrays are float64 unless they say otherwise; False means float32.
        cache: the folder for compiled functions, or "off" for none. Left out, it is
            `$FIRSTORDER_CACHE`, which may be "off" too, or else the folder `firstorder/jax` in
            the user's cache folder (`$XDG_CACHE_HOME`, or else `~/.cache`).
        optimize: False compiles on CPUs without optimisation, from the first use of a device to
            the end of the process; a level that `XLA_FLAGS` gives is kept.

    Returns:
        The folder in use; None if it is off, or cannot be written, which costs time only.

    Example:
        >>> import jax.numpy as jnp
        >>> import firstorder.session
        >>> folder = firstorder.session.start()
        >>> jnp.asarray(1.0).dtype
        dtype('float64')
    """
    missing = _missing(optimize)
    _warn_of_what_was_before(x64, missing)
    _give(missing)
    _keep_whole()
    _collect_seldom()
    _started.append(x64)
    jax.config.update("jax_enable_x64", x64)
    # On an H200, irradiance in space in float32 was off by a hundredth without it.
    jax.config.update("jax_default_matmul_precision", "highest")
    folder = _writable(_chosen(cache))
    jax.config.update("jax_compilation_cache_dir", None if folder is None else str(folder))
    # JAX's own thresholds skip what compiles in under a second, which here is nearly everything.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    # JAX settles on a folder at its first compilation; a notebook may have had that already.
    compilation_cache.reset_cache()
    return folder


def settings() -> dict[str, str | bool]:
    """Settings of this program that decide the last bits of a result, beside its numbers and seed.

    The same program with the same seed gives the same bytes as long as these are the same (and the
    same kind of device). Other versions and other flags of XLA may order sums otherwise, which
    changes last bits, and where random paths turn then perhaps more. Flags that only write what
    the compiler does (`--xla_dump_...`) are left out, and so are order and repetition.

    Returns:
        Versions of jax and jaxlib, whether arrays are float64, and the flags: `jax`, `jaxlib`,
        `x64`, `XLA_FLAGS`.

    Example:
        >>> from firstorder import session
        >>> sorted(session.settings())
        ['XLA_FLAGS', 'jax', 'jaxlib', 'x64']
    """
    flags = dict(flag.partition("=")[::2] for flag in os.environ.get("XLA_FLAGS", "").split())
    telling = sorted(f"{k}={v}" for k, v in flags.items() if not k.startswith("--xla_dump_"))
    return {
        "jax": jax.__version__,
        "jaxlib": jaxlib.__version__,
        "x64": _doubles(),
        "XLA_FLAGS": " ".join(telling),
    }


def differing(made: Mapping[str, object], now: Mapping[str, object], word: str = "now") -> str:
    """Words about settings that are not as they were, such as "jaxlib 0.9.0, now 0.10.2".

    Args:
        made: settings with which something was made.
        now: those of today, or of another program; what is in one of them alone counts.
        word: for that.

    Example:
        >>> from firstorder.session import differing
        >>> differing({"jaxlib": "0.9.0", "x64": True}, {"jaxlib": "0.10.2", "x64": True})
        'jaxlib 0.9.0, now 0.10.2'
    """
    return "; ".join(
        f"{name} {_said(made.get(name))}, {word} {_said(now.get(name))}"
        for name in (*now, *(made.keys() - now.keys()))
        if made.get(name) != now.get(name)
    )


def _said(value: object) -> str:
    return str(value) if value not in ("", None) else "none"


def warn_of_single_precision(stacklevel: int) -> None:
    """Warns that numbers are float32 where no `start` has said that they should be.

    Args:
        stacklevel: of `warnings.warn`, for the function that calls this one.

    Example:
        >>> from firstorder.session import start, warn_of_single_precision
        >>> folder = start(x64=True)
        >>> warn_of_single_precision(1)  # float64: nothing to say
    """
    if not (_started or _doubles()):
        warnings.warn(
            "Numbers are float32, of which derivatives lose digits: call "
            "firstorder.session.start() first, or start(x64=False) if they are meant to be.",
            stacklevel=stacklevel + 1,
        )


def _doubles() -> bool:
    """Whether numbers are float64 now."""
    return jax.dtypes.canonicalize_dtype(float) == "float64"


def _warn_of_what_was_before(x64: bool, missing: list[str]) -> None:
    """Warns of arrays that keep float32 although others will be float64, and of flags too late.

    To ask for arrays wakes the devices, which some programs have yet to set up: so only if they are
    awake. JAX says that inside of itself alone; where it does not, nothing is warned of.
    """
    try:
        from jax._src.xla_bridge import backends_are_initialized
    except ImportError:
        return
    if not backends_are_initialized():
        return
    before = jax.live_arrays() if x64 and not _doubles() else []
    early = [a for a in before if a.dtype in ("float32", "complex64")]
    if early:
        warnings.warn(
            f"Arrays made before session.start() keep float32 ({len(early)} of them): call it in "
            "the first lines of the program.",
            stacklevel=3,
        )
    late = {flag.partition("=")[0] for flag in missing if jax.default_backend() == "cpu"}
    for name, value, use in (
        (SOUND, "", "keeps this jaxlib from wrong sums"),
        (EFFORT, "0", "compiles without optimisation"),
    ):
        if name in late:
            warnings.warn(
                f"JAX already ran before session.start(), too late for the flag {name}={value} "
                f"that {use}: call it first, or set XLA_FLAGS.",
                stacklevel=3,
            )


def _missing(optimize: bool) -> list[str]:
    """Flags of this version, and of a compiler that is to be quick, that nobody has given."""
    flags = flags_of(jaxlib.__version__) + ([] if optimize else [f"{EFFORT}=0"])
    given = os.environ.get("XLA_FLAGS", "")
    return [flag for flag in flags if flag.partition("=")[0] not in given]


def _give(flags: list[str]) -> None:
    """Adds to the flags that XLA reads."""
    if flags:
        os.environ["XLA_FLAGS"] = " ".join([os.environ.get("XLA_FLAGS", ""), *flags]).strip()


def flags_of(version: str) -> list[str]:
    """Returns the flags that a version of jaxlib should be started with.

    Args:
        version: as `jaxlib.__version__` says it.

    Example:
        >>> from firstorder.session import flags_of
        >>> flags_of("0.12.0")
        ['--xla_cpu_experimental_ynn_fusion_type=']
    """
    parts = tuple(int(part) for part in version.split(".")[:3] if part.isdigit())
    return [f"{name}={value}" for name, value, first, end in FLAGS if first <= parts < end]


def _collect_seldom() -> None:
    """Lets Python look for cycles once in `OBJECTS` new ones, if it looks more often."""
    young, *older = gc.get_threshold()
    if 0 < young < OBJECTS:  # 0: never
        gc.set_threshold(OBJECTS, *older)


def _keep_whole() -> None:
    """Makes each compiled function appear in the folder whole or not at all.

    JAX writes it in place: who reads in that moment, or ever after a writer was killed, finds a
    part of it and warns. JAX lets nobody choose another way of writing, so this reaches into it;
    where it has changed inside, everything stays as JAX has it.
    """
    try:
        from jax._src import compilation_cache as inside
        from jax._src.lru_cache import _CACHE_SUFFIX, LRUCache
    except ImportError:
        return

    class WholeFiles(LRUCache):
        def put(self, key: str, value: bytes) -> None:
            if self.eviction_enabled:  # a folder of bounded size: JAX holds a lock on it
                return super().put(key, value)
            part = self.path / f"{uuid.uuid4().hex}.part"
            part.write_bytes(value)
            part.replace(self.path / f"{key}{_CACHE_SUFFIX}")

    inside.LRUCache = WholeFiles


def _chosen(cache: str | os.PathLike[str] | None) -> Path | None:
    """Returns the folder that the caller, the environment or the platform names, in this order."""
    named = cache or os.environ.get("FIRSTORDER_CACHE")
    if named:
        return None if named == OFF else Path(named).expanduser().absolute()
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "firstorder" / "jax"


def _writable(folder: Path | None) -> Path | None:
    """Returns the folder, made if need be, or None where it cannot be written."""
    if folder is None:
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None
