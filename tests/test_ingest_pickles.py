"""Pickles: what maps need is read exactly; what would run code, or take memory, is refused by name before it does."""

from __future__ import annotations

import collections
import gzip
import io
import pickle
import random
import struct
import subprocess
import sys
import time
import uuid
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import pytest

from cgdb.errors import FormatError
from cgdb.ingest import gunzip, pickles
from cgdb.ingest.pickled import Inert


def read(data: bytes, size: int = 0) -> Any:
    return pickles.load(io.BytesIO(data), size=size)


PROTOCOLS = range(2, pickle.HIGHEST_PROTOCOL + 1)


class Plain:
    """Not on the list; its pickle names this class."""


class Calls:
    """Pickles as a call of any function with any arguments."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = (function, arguments)

    def __reduce__(self) -> Any:
        return self.call


def global_call(module: str, name: str, argument: str) -> dict[str, bytes]:
    """The ways in which the opcodes can call module.name(argument)."""
    text = b"\x8c" + bytes([len(argument)]) + argument.encode()
    named = f"c{module}\n{name}\n".encode()
    stacked = b"".join(b"\x8c" + bytes([len(part)]) + part.encode() for part in (module, name)) + b"\x93"
    return {
        "GLOBAL REDUCE": b"\x80\x02" + named + text + b"\x85R.",
        "STACK_GLOBAL REDUCE": b"\x80\x04" + stacked + text + b"\x85R.",
        "NEWOBJ": b"\x80\x04" + stacked + text + b"\x85\x81.",
        "NEWOBJ_EX": b"\x80\x04" + stacked + text + b"\x85}\x92.",
        "INST": b"(" + text + f"i{module}\n{name}\n.".encode(),
        "OBJ": b"(" + named + text + b"o.",
        "protocol 0": f"c{module}\n{name}\n(S'{argument}'\ntR.".encode(),
    }


HOSTILE = [
    ("os", "system"),
    ("posix", "system"),
    ("nt", "system"),
    ("subprocess", "Popen"),
    ("builtins", "eval"),
    ("builtins", "exec"),
    ("builtins", "getattr"),
    ("builtins", "__import__"),
    ("__builtin__", "apply"),
    ("builtins", "open"),
    ("importlib", "import_module"),
    ("runpy", "run_path"),
    ("pickle", "loads"),
    ("numpy", "load"),
    ("numpy", "fromfile"),
    ("numpy.core.multiarray", "fromfile"),
    ("numpy", "memmap"),
    ("numpy.testing._private.utils", "runstring"),
    ("numpy", "ndarray.tofile"),
    ("numpy", "ndarray.__reduce__"),
    ("collections", "namedtuple"),
    ("functools", "partial"),
    ("operator", "attrgetter"),
    ("uuid", "_popen"),
    ("pathlib", "Path.unlink"),
    ("pathlib", "os.system"),
    ("copyreg", "_reconstructor"),
    ("_codecs", "lookup"),
]


@pytest.mark.parametrize(("module", "name"), HOSTILE)
@pytest.mark.parametrize("way", sorted(global_call("m", "n", "a")))
def test_what_is_not_listed_is_refused_by_name_and_not_run(tmp_path: Path, module: str, name: str, way: str) -> None:
    marker = tmp_path / "ran"
    data = global_call(module, name, f"touch {marker}")[way]
    with pytest.raises(FormatError) as told:
        read(data)
    assert "refused" in told.value.message and f"{module}.{name}" in told.value.message
    assert "\n" not in told.value.message
    assert not marker.exists()


def test_the_attack_would_have_worked_on_pythons_own_unpickler(tmp_path: Path) -> None:
    """The marker of the test above is a real one: without this the test could not fail."""
    marker = tmp_path / "ran"
    module = "nt" if sys.platform == "win32" else "posix"
    pickle.loads(global_call(module, "system", f"touch {marker}")["STACK_GLOBAL REDUCE"])
    assert marker.exists()


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_calls_hidden_inside_allowed_things_are_refused(tmp_path: Path, protocol: int) -> None:
    import os

    marker = tmp_path / "ran"
    evil = Calls(os.system, f"touch {marker}")
    array = np.empty(2, dtype=object)
    array[0] = evil
    hidden = [
        array,
        collections.OrderedDict(a=[evil]),
        collections.defaultdict(list, a=evil),
        {"objects": [{"bbox_np": np.zeros((8, 3)), "pcd_np": evil}]},
        Calls(collections.defaultdict, evil),
        Calls(np.dtype, evil),
    ]
    for value in hidden:
        with pytest.raises(FormatError, match=r"refused: the pickle asks for \w+\.system"):
            read(pickle.dumps(value, protocol=protocol))
    assert not marker.exists()


def test_a_default_factory_never_runs() -> None:
    value = read(pickle.dumps(collections.defaultdict(list, a=1)))
    assert value == {"a": 1} and type(value) is dict
    with pytest.raises(KeyError):
        value["missing"]


@pytest.mark.parametrize(
    ("what", "data"),
    [
        ("a persistent id", b"\x80\x02U\x01xQ."),
        ("an old persistent id", b"Pfile\n."),
        ("an extension code", b"\x80\x02\x82\x01."),
        ("a buffer from elsewhere", b"\x80\x05\x97."),
        ("a call of a value", b"\x80\x02U\x01x)R."),
        ("a call of a token", b"\x80\x02cbuiltins\nobject\n)R."),
        ("state for a global", b"\x80\x02cnumpy\nndarray\n}b."),
        ("state for a dictionary", b"\x80\x02}}b."),
        ("bytes out of nothing", b"\x80\x02cbuiltins\nbytes\nJ\xff\xff\xff\x7f\x85R."),
        ("named arguments", b"\x80\x04cuuid\nUUID\n)}U\x03hexU\x01xs\x92."),
        (
            "an array of a subclass",
            b"\x80\x02cnumpy._core.multiarray\n_reconstruct\ncbuiltins\nobject\nK\x00\x85U\x01b\x87R.",
        ),
    ],
)
def test_ways_out_of_the_machine_are_refused(what: str, data: bytes) -> None:
    with pytest.raises(FormatError, match="refused"):
        read(data)


@pytest.mark.parametrize(
    ("what", "data"),
    [
        ("nothing", b""),
        ("no STOP", b"\x80\x04]"),
        ("an empty stack", b"\x80\x04."),
        ("a memo that was not made", b"\x80\x04h\x07."),
        ("no mark", b"\x80\x04]e."),
        ("a mapping of odd length", b"\x80\x04}(K\x01u."),
        ("text that is not UTF-8", b"\x80\x04\x8c\x01\xff."),
        ("a protocol that does not exist", b"\x80\x63N."),
        ("an integer too long", b"\x80\x02\x8b\xff\xff\xff\x7f" + b"\x01" * 4000 + b"."),
        ("an integer of negative length", b"\x80\x02\x8b\xff\xff\xff\xff."),
        ("a tuple of too little", b"\x80\x02K\x01\x87."),
    ],
)
def test_damage_is_told_in_one_line(what: str, data: bytes) -> None:
    with pytest.raises(FormatError) as told:
        read(data)
    assert "\n" not in told.value.message


def hostile_array(shape: bytes, content: bytes, *, code: bytes = b"f8") -> bytes:
    dtype = (
        b"cnumpy\ndtype\nU"
        + bytes([len(code)])
        + code
        + b"\x89\x88\x87R(K\x03U\x01<NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb"
    )
    empty = b"cnumpy._core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85C\x01b\x87R"
    return b"\x80\x03" + empty + b"(K\x01" + shape + dtype + b"\x89" + content + b"tb."


TRILLION = b"\x8a\x06" + (10**12).to_bytes(6, "little")


@pytest.mark.parametrize(
    ("what", "data"),
    [
        ("a shape larger than its bytes", hostile_array(TRILLION + b"\x85", b"C\x04abcd")),
        (
            "a product that overflows",
            hostile_array((b"\x8a\x05" + (2**32).to_bytes(5, "little")) * 2 + b"\x86", b"C\x00"),
        ),
        ("a negative side", hostile_array(b"J\xff\xff\xff\xff\x85", b"C\x08abcdefgh")),
        ("a true side", hostile_array(b"\x88\x85", b"C\x08abcdefgh")),
        ("too many sides", hostile_array(b"(" + b"K\x01" * 40 + b"t", b"C\x08abcdefgh")),
        ("a list for its bytes", hostile_array(b"K\x01\x85", b"]")),
        ("an object array shorter than its shape", hostile_array(TRILLION + b"\x85", b"]", code=b"O8")),
        ("an object array of callables", hostile_array(b"K\x01\x85", b"](cbuiltins\ndict\ne", code=b"O8")),
        ("an object array of itself", hostile_array(b"K\x01\x85", b"](]e", code=b"O8")),
        ("a record type", hostile_array(b"K\x01\x85", b"C\x00", code=b"i4,O")),
        ("a void type", hostile_array(b"K\x01\x85", b"C\x08abcdefgh", code=b"V8")),
        ("a text type of a gigabyte", hostile_array(b"K\x01\x85", b"C\x00", code=b"U999999999")),
        ("text of no size", hostile_array(TRILLION + b"\x85", b"C\x00", code=b"U0")),
    ],
)
def test_absurd_arrays_are_refused_before_memory_is_taken(what: str, data: bytes) -> None:
    with pytest.raises(FormatError):
        read(data)


def test_the_hand_made_array_is_a_good_one() -> None:
    """So that the refusals above are about what is wrong with each, not about how they are made."""
    assert read(hostile_array(b"K\x01\x85", b"C\x08" + struct.pack("<d", 1.5))).tolist() == [1.5]


BILLION_LAUGHS = (
    b"\x80\x04]"
    + b"\x94"
    + b"".join(b"](" + b"h" + bytes([i]) * 1 + (b"h" + bytes([i])) * 9 + b"e\x94" for i in range(40))
    + b"."
)
COPIES = b"\x80\x04](" + b"N" * 200_000 + b"e\x94" + b"(" + b"cbuiltins\nlist\nh\x00\x85R" * 100_000 + b"l."
TUPLE_KEYS = (
    b"\x80\x04)\x94" + b"".join(b"h" + bytes([i]) + b"h" + bytes([i]) + b"\x86\x94" for i in range(60)) + b"}h\x3cNs."
)
OBJECT_COPIES = (
    b"\x80\x04]("
    + b"N" * 100_000
    + b"e\x94("
    + (hostile_array(b"J\xa0\x86\x01\x00\x85", b"h\x00", code=b"O8")[2:-1] * 2000)
    + b"l."
)


def test_copies_and_keys_that_multiply_are_refused() -> None:
    for data in (COPIES, TUPLE_KEYS, OBJECT_COPIES):
        started = time.perf_counter()
        with pytest.raises(FormatError):
            read(data)
        assert time.perf_counter() - started < 20


def test_a_billion_laughs_stay_one_list(tmp_path: Path) -> None:
    """Shared lists cost what they hold; nobody walks them, not even the error that describes them."""
    from cgdb import ingest

    path = tmp_path / "m.pkl"
    path.write_bytes(BILLION_LAUGHS)
    assert isinstance(read(BILLION_LAUGHS), list)
    started = time.perf_counter()
    for name in ("conceptgraphs-main", "conceptgraphs-ali", None):
        with pytest.raises(FormatError) as told:
            ingest.load(path, format=name, relate=False)
        assert len(told.value.message) < 1000
    assert time.perf_counter() - started < 5


def test_endless_steps_are_counted() -> None:
    with pytest.raises(FormatError, match="bomb"):
        read(b"\x80\x04(" + b"]" * (pickles.MOST_STEPS + 10) + b"l.")


def test_depth_costs_no_stack() -> None:
    value = read(b"\x80\x04" + b"]" * 200_000 + b"a" * 199_999 + b".")
    assert isinstance(value, list)


LIMITED = """
import gzip, io, resource, sys
from cgdb.errors import FormatError
from cgdb.ingest import gunzip, pickles
from pathlib import Path
import numpy
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for path in sys.argv[1:]:
    try:
        with gunzip.open_bounded(Path(path)) as file:
            pickles.load(file, size=Path(path).stat().st_size)
    except FormatError as error:
        print(error.message)
    else:
        raise SystemExit(f"{path} was read")
grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
raise SystemExit(f"{grown:.0f} MB were taken" if grown > 400 else 0)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="measures memory as Linux counts it")
def test_bombs_are_refused_within_little_memory(tmp_path: Path) -> None:
    huge = struct.pack("<Q", 1 << 40)
    bombs = {
        "bytes": b"\x80\x04\x8e" + huge + b"x",
        "text": b"\x80\x04\x8d" + huge + b"x",
        "bytearray": b"\x80\x05\x96" + huge + b"x",
        "frame": b"\x80\x04\x95" + huge + b"x",
        "shape": hostile_array(TRILLION + b"\x85", b"C\x04abcd"),
        "steps": b"\x80\x04(" + b"}\x94" * 3_000_000 + b"l.",
        "copies": COPIES,
    }
    paths = []
    for name, data in bombs.items():
        paths.append(tmp_path / f"{name}.pkl.gz")
        paths[-1].write_bytes(gzip.compress(data, compresslevel=1))
    zeros = tmp_path / "zeros.pkl.gz"
    with gzip.open(zeros, "wb", compresslevel=9) as file:
        file.write(b"\x80\x04B" + struct.pack("<I", 600 << 20))
        for _ in range(600):
            file.write(bytes(1 << 20))
    assert zeros.stat().st_size < 1 << 20
    paths.append(zeros)
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, *map(str, paths)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(done.stdout.splitlines()) == len(paths)
    assert "gzip bomb" in done.stdout.splitlines()[-1]


def test_the_limit_of_unfolding_can_be_set(tmp_path: Path) -> None:
    path = tmp_path / "m.gz"
    path.write_bytes(gzip.compress(bytes(1000)))
    with gunzip.open_bounded(path, max_bytes=1000) as file:
        assert len(file.read()) == 1000
    with gunzip.open_bounded(path, max_bytes=999) as file, pytest.raises(FormatError, match="999 bytes"):
        file.read()


ARRAYS = [
    np.arange(12, dtype=np.float64).reshape(4, 3),
    np.asfortranarray(np.arange(12, dtype=np.float32).reshape(4, 3)),
    np.arange(5, dtype=">i4"),
    np.array([True, False]),
    np.zeros((0, 3)),
    np.array(7.5),
    np.array(["a", "ä"]),
    np.array(["x", None, 3], dtype=object),
]


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_arrays_come_back_exactly(protocol: int) -> None:
    for array in ARRAYS:
        got = read(pickle.dumps(array, protocol=protocol))
        assert got.dtype == array.dtype and got.shape == array.shape and np.array_equal(got, array)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_plain_values_come_back_exactly(protocol: int) -> None:
    shared = ["shared"]
    value = {
        "numbers": [0, -1, 255, 65536, 2**70, -(2**70), 1.5, True, None],
        "text": ["", "ä", "x" * 5000],
        "nested": (1, (2, (3, {"four": 5})), shared, shared),
        "sets": [{1, 2}, frozenset({"a"})],
        "ordered": collections.OrderedDict([("b", 1), ("a", 2)]),
        ("tuple", 1): "key",
    }
    got = read(pickle.dumps(value, protocol=protocol))
    assert got == value
    assert got["nested"][2] is got["nested"][3]


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_the_odd_things_of_maps_come_back_as_plain_ones(protocol: int) -> None:
    mark = uuid.uuid4()
    value = [PurePosixPath("a/b.png"), mark, mark, np.float32(0.5), np.int64(-3), np.bool_(True)]
    assert read(pickle.dumps(value, protocol=protocol)) == ["a/b.png", str(mark), str(mark), 0.5, -3, True]


def test_masks_are_let_go() -> None:
    value = read(pickle.dumps({"mask": [np.ones((300, 300), dtype=bool)], "flags": np.array([True])}))
    assert value["mask"] == [None] and value["flags"].tolist() == [True]


def test_leftovers_become_inert_and_import_nothing() -> None:
    names = ("omegaconf.dictconfig", "DictConfig"), ("torch._utils", "_rebuild_tensor_v2"), ("torch.hub", "load")
    for module, name in names:
        data = f"\x80\x02c{module}\n{name}\nU\x01x\x85R}}U\x01aK\x01sb.".encode("latin-1")
        got = read(data)
        assert isinstance(got, Inert) and got.name == f"{module}.{name}"
    assert "omegaconf" not in sys.modules and "torch" not in sys.modules


def test_a_class_of_anyone_is_refused_by_name() -> None:
    with pytest.raises(FormatError, match="Plain"):
        read(pickle.dumps(Plain()))


def test_damaged_bytes_give_a_value_or_one_clear_line() -> None:
    """Every error that is not ours would fail the test; so would a hang."""
    rng = random.Random(7)
    good = pickle.dumps({"objects": [{"pcd_np": np.ones((4, 3)), "id": uuid.uuid4(), "tags": ["a", ("b", 1)]}] * 2})
    for _ in range(4000):
        bad = bytearray(good)
        for _ in range(rng.randint(1, 4)):
            bad[rng.randrange(len(bad))] = rng.randrange(256)
        data = bytes(bad[: rng.randint(1, len(bad))]) if rng.random() < 0.2 else bytes(bad)
        try:
            read(data)
        except FormatError as error:
            assert "\n" not in error.message
