"""Files of every format, damaged at random: each is read, or refused in one line that says what to do."""

import gzip
import struct
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
import sample_files as sample
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from measured_reads import MeasuredReads

from fuzzing import examples

# Words of which each refusal has one: what to do.
REMEDIES = (
    "copy it again", "rename it", "record it again", "export it", "is no table", "save it", "reindex", "give the",
    "give that", "fetch", "unpack", "must be stated", "state text", "write it there", "write seconds", "split the file",
    "ccmodel import", "if that is right", "separated by commas",
)  # fmt: skip
LONGEST_S, MOST_MB = 10.0, 2000.0
# Values that a length, a count or an offset may take.
ODD_NUMBERS = (0, 1, 2, 3, 7, 255, 2**15, 2**16 - 1, 2**24, 2**28, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)
HEADER, TAIL = 512, 2048


@pytest.fixture(scope="module")
def reads():
    process = MeasuredReads()
    yield process
    process.close()


def gzipped(path):
    path.write_bytes(gzip.compress(sample.text(path).read_bytes(), mtime=0))
    return path


# The usual way to write each format, and ways in which damage is hidden by compression, or is not.
WRITERS = sample.WRITERS | {
    "log.csv.gz": gzipped,
    "plain.mat": lambda path: sample.mat5(path, compression=False),
    "plain.h5": lambda path: sample.hdf5(path, compression=None),
    "plain.parquet": lambda path: sample.parquet(path, compression="none", dictionary=False),
    "packed.mf4": lambda path: sample.mdf4(path, compression=2),
    "old.mdf": sample.mdf3,
    "packed.bag": lambda path: sample.ros1(path, compression="BZ2"),
    "lz4.bag": lambda path: sample.ros1(path, compression="LZ4"),
    "packed.mcap": lambda path: sample.mcap(path, compressed=True),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The bytes of a sound file of each format."""
    folder = tmp_path_factory.mktemp("sound")
    return {name: write(folder / name).read_bytes() for name, write in WRITERS.items()}


class Damage(NamedTuple):
    """One damage; a place is a share of the file, or of its header or its end."""

    how: str
    region: str
    at: float
    size: int
    number: int
    content: bytes


places = st.floats(0, 1, exclude_max=True)
damages = st.builds(
    Damage,
    st.sampled_from(["flip", "flips", "number", "number", "zero", "gone", "twice", "new", "cut", "foreign"]),
    st.sampled_from(["all", "header", "end"]),
    places,
    st.sampled_from([1, 2, 4, 8, 16, 64, 300, 1024]),
    st.sampled_from(ODD_NUMBERS),
    st.binary(min_size=1, max_size=16),
)


@cache
def numbers(raw: bytes) -> list[tuple[int, str]]:
    """Where a number stands that may be a length, a count or an offset, and how it is written."""
    found = []
    for at in range(len(raw) - 8):
        for code in ("<Q", ">Q", "<I", ">I", "<H", ">H"):
            value = struct.unpack_from(code, raw, at)[0]
            if 0 < value <= 2 * len(raw) and (code[1] != "H" or at < HEADER):
                found.append((at, code))
                break
    return found


def with_damage(raw: bytes, damage: Damage, found: list[tuple[int, str]], others: list[bytes]) -> bytes:
    first, last = {"all": (0, len(raw)), "header": (0, HEADER), "end": (len(raw) - TAIL, len(raw))}[damage.region]
    first, last = max(first, 0), min(last, len(raw))
    at, size = first + int(damage.at * (last - first)), damage.size
    result = bytearray(raw)
    match damage.how:
        case "flip":
            result[at] ^= damage.content[0] or 1
        case "flips":
            for i, byte in enumerate(damage.content):
                result[first + (at - first + 7919 * i) % (last - first)] ^= byte
        case "number":
            set_number(result, damage, [one for one in found if first <= one[0] < last])
        case "zero":
            result[at : at + size] = bytes(len(raw[at : at + size]))
        case "gone":
            del result[at : at + size]
        case "twice":
            result[at:at] = raw[at : at + size]
        case "new":
            result[at:at] = damage.content * (1 + size // 16)
        case "cut":
            del result[at:]
        case "foreign":
            other = others[damage.content[0] % len(others)]
            start = int(damage.at * len(other)) if damage.region == "all" else 0
            result[at : at + size] = other[start : start + size]
    return bytes(result)


def set_number(raw: bytearray, damage: Damage, found: list[tuple[int, str]]) -> None:
    if found:
        where, code = found[int(damage.at * len(found))]
        size = struct.calcsize(code)
        if where + size <= len(raw):
            struct.pack_into(code, raw, where, min(damage.number, 256**size - 1))


def damaged(raw: bytes, inside: bool, several: list[Damage], others: list[bytes]) -> bytes:
    """A file with some damages; of a gzipped one, `inside` what is gzipped."""
    inside = inside and raw[:2] == b"\x1f\x8b"
    raw = gzip.decompress(raw) if inside else raw
    found = numbers(raw)
    for damage in several:
        raw = with_damage(raw, damage, found, others) if raw else raw
    return gzip.compress(raw, mtime=0) if inside else raw


def check(read) -> None:
    assert not read.fault, read.fault
    assert read.seconds < LONGEST_S and read.megabytes < MOST_MB, read
    if (text := read.refusal) is not None:
        assert text and "\n" not in text and len(text) < 400 and "Traceback" not in text, text
        assert any(remedy in text for remedy in REMEDIES), text


@pytest.mark.parametrize("name", WRITERS)
def test_a_damaged_file_is_read_or_refused(name, sound, reads, tmp_path):
    raw, path = sound[name], tmp_path / name
    others = [other for called, other in sound.items() if called != name]

    @settings(max_examples=examples(50), suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(inside=st.booleans(), several=st.lists(damages, min_size=1, max_size=4))
    def each(inside, several):
        path.write_bytes(damaged(raw, inside, several, others))
        check(reads.read(path))

    path.write_bytes(raw)
    check(reads.read(path))
    each()


@pytest.mark.parametrize("name", sample.WRITERS)
def test_random_bytes_behind_a_sound_beginning(name, sound, reads, tmp_path):
    for seed in range(40):
        (tmp_path / name).write_bytes(sound[name][: 16 + seed] + np.random.default_rng(seed).bytes(3000))
        read = reads.read(tmp_path / name)
        check(read)
        assert read.refusal is not None
