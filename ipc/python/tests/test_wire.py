"""Names and numbers on the bus are those of the Rust crate."""

import re
from pathlib import Path

import bench_dragon

WIRE = Path(__file__).parents[2] / "src" / "wire"


def test_every_enum_of_the_wire_has_the_names_and_the_numbers_of_the_rust_crate():
    sources = "\n".join(path.read_text() for path in sorted(WIRE.glob("*.rs")))
    enums = re.findall(
        r"^wire_enum! \{\n(?:    [/#].*\n)*    (\w+) \{\n((?:     .*\n)*)    \}\n\}$",
        sources,
        re.MULTILINE,
    )
    assert len(enums) == sources.count("\nwire_enum! {") > 0
    for name, body in enums:
        numbers = {in_capitals(variant): int(number) for variant, number in re.findall(r"(\w+) = (\d+), \"", body)}
        assert numbers == {code.name: code.value for code in getattr(bench_dragon, name)}, name


def test_every_refusal_has_the_name_and_the_number_of_the_rust_crate():
    source = (WIRE / "command.rs").read_text()
    (listed,) = re.findall(r"fn by_number\(.*?\n        \[\n(.*?)\n        \]", source, re.DOTALL)
    names = [in_capitals(variant) for variant in re.findall(r"Self::(\w+)", listed)]
    assert dict(enumerate(names, 1)) == {refusal.value: refusal.name for refusal in bench_dragon.Refusal}


def in_capitals(variant):
    """Returns the Python name of a Rust variant: OUT_OF_RANGE for OutOfRange."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", variant).upper()
