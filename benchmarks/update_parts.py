"""Where the time of a fused update goes, part by part, beside the floor of its arithmetic.

    python benchmarks/update_parts.py

Compiles the kernel for one instruction set with clocks around its parts, which the module does not
have. A part's floor is the time of its multiplications and additions at the rate of NumPy's product
of two large matrices, measured before; parts without a floor are no products.
"""

import argparse
import os
import subprocess
import tempfile
from pathlib import Path

SETS = {"avx512": ("SkylakeX", 16, "x86-64-v4"), "avx2": ("Haswell", 8, "x86-64-v3")}
CASES = (((100, 100, 100), 64, False), ((64, 64), 64, True))
HERE = Path(__file__).parent
CSRC = HERE.parent / "csrc"
D, A = 8, 4


def compiled(folder: Path, name: str) -> Path:
    """The program that times the parts, for an instruction set."""
    _, width, march = SETS[name]
    out = folder / name
    flags = ["-std=c++20", "-O3", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math"]
    flags += ["-Wno-psabi", f"-march={march}", f"-I{CSRC}", "-DTOUCHDOWN_X86_KERNELS"]
    flags += [f"-DTOUCHDOWN_KERNEL={name}", f"-DTOUCHDOWN_WIDTH={width}"]
    source = HERE / "update_parts" / "parts.cpp"
    subprocess.run(["c++", *flags, str(source), "-o", str(out)], check=True)  # noqa: S607 - the compiler
    return out


def floors(hidden: tuple[int, ...], batch_size: int, rate: float) -> dict[str, float]:
    """Microseconds of the products in each part."""
    layers = list(zip((D, *hidden), (*hidden, A), strict=True))
    whole = 2e6 * batch_size * sum(a * b for a, b in layers) / rate
    first = 2e6 * batch_size * layers[0][0] * layers[0][1] / rate
    return {
        "update": 4 * whole - first,
        "forward, activations kept": whole,
        "forward, target network": whole,
        "backward, to the inputs": whole - first,
        "gradient of the weights": whole,
    }


def table(name: str, folder: Path) -> None:
    """Print a table for each case, with one instruction set."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # NumPy reads both on import
    os.environ["OPENBLAS_CORETYPE"] = SETS[name][0]
    from fused_update import product_rate  # noqa: PLC0415 - it loads NumPy

    program = compiled(folder, name)
    for hidden, batch_size, layer_norm in CASES:
        floor = floors(hidden, batch_size, product_rate())
        words = [str(batch_size), str(int(layer_norm)), *map(str, hidden)]
        made = subprocess.run([program, *words], check=True, capture_output=True, text=True)
        what = f"{list(hidden)}{', layer norm' * layer_norm}, minibatch {batch_size}, {name}"
        print(f"{what}\n\n| part | µs | floor, µs |\n| --- | ---: | ---: |")
        for line in made.stdout.splitlines():
            part, _, took = line.rpartition(",")
            least = f"{floor[part]:.1f}" if part in floor else "–"
            print(f"| {part} | {float(took):.1f} | {least} |")
        print()


def main() -> None:
    """Print the tables of one instruction set."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--simd", choices=SETS, default="avx512")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        table(args.simd, Path(folder))


if __name__ == "__main__":
    main()
