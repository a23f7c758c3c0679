"""TOML experiments as nobody should write them: each is refused by one sentence, and a name stays in its folder."""

import csv
import errno
import os
import re
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.machine.datafiles import UNITS_OF, read_toml

# What works, key by key; every case below differs from it in one place.
GOOD = {
    "manipulator": {
        "base": "[[-0.2, 0.0], [0.2, 0.0], [0.0, 0.3]]", "lengths": "0.25", "masses": "0.1", "centers": "0.125",
        "inertias": "1e-3", "rotor_inertia": "1e-6", "resistance": "0.6", "torque_constant": "0.02",
        "friction": "4e-3", "friction_velocity": "0.01", "gravity": "[0.0, -9.81]", "load": "0.1", "mode": "1",
    },
    "control": {"K_P": "7.0", "K_D": "0.2", "dt": "0.01"},
    "path": {"side": "0.1", "duration": "0.6", "centre": "[0.0, 0.1]", "angle": "0.1", "rest": "0.05"},
    "sensor": {"offset": "[1e-3, 0.0, 0.0]", "encoder": "2000", "velocity_filter": "0.002"},
}  # fmt: skip
FAULTS = {
    "DeadDrive": {"drive": "1", "time": "0.1"},
    "EncoderDropout": {"drive": "1", "start": "0.1", "stop": "0.2"},
    "OffsetJump": {"drive": "1", "time": "0.1", "jump": "1e-3"},
    "TorqueLimit": {"limit": "0.5"},
}
KEYS = [(table, key) for table, keys in GOOD.items() for key in keys]
DEEP = "[" * 30 + "1.0" + "]" * 30
WRONG = [
    "'abc'", "''", "true", "false", "nan", "-inf", "9" * 400, "1e400", "[]", "[[1.0], [2.0, 3.0]]", "['1.0', '2.0']",
    "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "[true, true, true]", "{}", "{value = {value = 1.0}}", "-1e99",
    "[1.0, nan, 2.0]", DEEP, "'../../etc/passwd'", r'"a\u0000b"',
]  # fmt: skip


def text(changes=(), without=(), table_without=(), more=""):
    """The tables of GOOD as TOML, with some entries changed or left out."""
    changes, lines = dict(changes), []
    for table, keys in GOOD.items():
        if table in table_without:
            continue
        lines.append(f"[{table}]")
        lines += [f"{k} = {changes.get((table, k), v)}" for k, v in keys.items() if (table, k) not in without]
    return "\n".join([*lines, more, ""])


@pytest.fixture
def said(tmp_path):
    """The sentence that refuses a file of this text; one line of printable characters."""

    def of(words, name="mine.toml"):
        path = tmp_path / name
        path.write_bytes(words if isinstance(words, bytes) else words.encode())
        with pytest.raises(ValueError) as caught:
            rk.experiment(path)
        sentence = str(caught.value)
        assert re.search("allowed|needed", sentence), sentence
        assert not isinstance(caught.value, np.linalg.LinAlgError)
        assert sentence.isprintable() and len(sentence) < 700, sentence
        return sentence

    return of


def test_the_good_file_is_good(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text(), encoding="utf-8")
    assert rk.experiment(path).robot.n_arms == 3
    units = {(t, k): f"{{value = {v}, unit = '{UNITS_OF[t][k]}'}}" for t, keys in GOOD.items() for k, v in keys.items()}
    path.write_text(text(units), encoding="utf-8")
    assert repr(rk.experiment(path)) == repr(rk.experiment(path))
    for kind, entries in FAULTS.items():
        fault = "".join(f"{k} = {{value = {v}, unit = '{UNITS_OF['fault'][k]}'}}\n" for k, v in entries.items())
        path.write_text(text(more=f"[[fault]]\nkind = '{kind}'\n{fault}"), encoding="utf-8")
        assert type(rk.experiment(path).faults[0]).__name__ == kind


def test_a_mark_before_the_first_line_is_no_part_of_the_file(tmp_path):
    path, read = tmp_path / "mine.toml", []
    for mark in (b"", b"\xef\xbb\xbf"):
        path.write_bytes(mark + text().encode())
        read.append((rk.experiment(path), rk.load(path)))
    assert read[0] == read[1]


@pytest.mark.parametrize("line", [1, 2, 3])
def test_a_field_of_a_log_ends_in_its_line(tmp_path, line):
    """A quoted field may go on in the next line; then lines would no longer be records."""
    lines = ["t in s,q1 measured in rad,q1 desired in rad,c1 in N m", "0,0.5,0,0", "1,0.5,0,0", "2,x,0,0"]
    cells = lines[line - 1].split(",")
    lines[line - 1] = ",".join([cells[0], f'"{cells[1]}\n"', *cells[2:]])
    file = tmp_path / "own.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(
        ValueError, match=rf"the log 'own.csv', line {line}, column 2 .*holds '{cells[1]}\\n'; allowed: "
    ):
        rk.read_log(file)


@pytest.mark.parametrize("number", ["1_0", "1_0.5", "0.1_5", "1e1_0"])
def test_numbers_of_a_log_hold_no_underscore(tmp_path, number):
    """Python reads them so: float("1_0") is 10."""
    lines = Path(rk.data_path("mystery_runs/gain.csv")).read_text(encoding="utf-8").splitlines()
    cells = lines[3].split(",")
    lines[3] = ",".join([*cells[:4], number, *cells[5:]])
    file = tmp_path / "own.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(ValueError, match=rf"line 4, column 5 \(.*\) holds '{re.escape(number)}'; allowed: numbers"):
        rk.read_log(file)


@pytest.mark.parametrize("number", ["-1e200", "1e200", "1e100", "-inf", "nan"])
def test_numbers_of_a_log_are_finite_and_within_reason(tmp_path, number):
    file = tmp_path / "own.csv"
    rk.write_log(rk.Log("own", [0.0], *np.zeros((3, 1, 3))), file)
    head, row = file.read_text(encoding="utf-8").splitlines()
    cells = row.split(",")
    cells[4] = number
    file.write_text("\n".join([head, ",".join(cells)]), encoding="utf-8")
    with pytest.raises(ValueError, match=r"line 2, column 5 \(q1 desired in rad\) holds"):
        rk.read_log(file)


@pytest.mark.parametrize("N", [1, 2, 3, 5])
def test_a_log_written_is_the_log_read_to_the_last_bit(tmp_path, N):
    random = np.random.default_rng(N)
    columns = random.normal(0.0, 1.0, (3, 40, N)) * 10.0 ** random.integers(-12, 12, (3, 40, N))
    log = rk.Log("own", np.arange(40) / 3.0, *columns)
    rk.write_log(log, tmp_path / "own.csv")
    assert rk.read_log(str(tmp_path / "own.csv")) == log


@pytest.mark.parametrize("key", ["K_P", "K_D"])
def test_gains_of_another_number_of_drives_are_refused_when_a_file_is_read(said, key):
    sentence = said(text({("control", key): "[7.0, 7.0]"}))
    assert key in sentence and "(2,)" in sentence


@pytest.mark.parametrize("target", ["", "no/such/folder/own.csv", ".", "a\0b", None, 3, b"own.csv"])
def test_a_log_is_written_to_a_file_or_not_at_all(tmp_path, monkeypatch, target):
    monkeypatch.chdir(tmp_path)
    # Every sentence has a reason, though the error of a NUL has no number of the system's.
    with pytest.raises(ValueError, match=r"target = .*; allowed: ") as caught:
        rk.write_log(rk.mystery_run("gain"), target)
    assert "None)" not in str(caught.value)
    with pytest.raises(ValueError, match=r"log = .*; allowed: a Log"):
        rk.write_log([1.0], "own.csv")
    with pytest.raises(ValueError, match=r"line 5, column 1: after 0\.2 s comes 0\.9 s.*; allowed: a log without gaps"):
        rk.write_log(rk.Log("gap", [0.0, 0.1, 0.2, 0.9], *np.zeros((3, 4, 3))), "own.csv")
    assert not list(tmp_path.iterdir())


def test_the_first_column_too_many_is_named(tmp_path):
    file = tmp_path / "own.csv"
    rk.write_log(rk.Log("own", [0.0, 0.1], *np.zeros((3, 2, 3))), file)
    file.write_text(re.sub("(?m)$", ",temperature", file.read_text("utf-8").strip()), encoding="utf-8")
    with pytest.raises(ValueError, match=r"line 1, column 11 holds 'temperature'; allowed: the header t in s"):
        rk.read_log(file)


@pytest.mark.parametrize("missing", range(1, 11))
def test_the_first_column_that_is_missing_is_named(tmp_path, missing):
    """Of three drives: two columns of each kind do not make it a log of two drives, nor do three more a fourth."""
    kinds = [f"q{i} {what} in rad" for what in ("measured", "desired") for i in (1, 2, 3)]
    header, file = ["t in s", *kinds, *(f"c{i} in N m" for i in (1, 2, 3))], tmp_path / "own.csv"
    words = rf"{', '.join(header)} \(of a file in another form, make a Log\)"
    left = header[: missing - 1] + header[missing:]
    held = repr(header[missing]) if missing < 10 else "nothing"
    file.write_text(",".join(left), encoding="utf-8")
    with pytest.raises(ValueError, match=rf"line 1, column {missing} holds {held}; .* header {words}$"):
        rk.read_log(file)
    file.write_text(",".join([*header, "a", "b", "c"]), encoding="utf-8")
    with pytest.raises(ValueError, match=rf"line 1, column 11 holds 'a'; .* header {words}$"):
        rk.read_log(file)


def test_a_log_says_how_long_it_is():
    assert ", 2 records, 9 s, 3 drives)" in repr(rk.Log("late", [1000.0, 1009.0], *np.zeros((3, 2, 3))))


@pytest.mark.parametrize("shape", [(0, 3), (1, 0)])
def test_a_log_has_a_record_and_a_drive(shape):
    with pytest.raises(ValueError, match=r"allowed: \(k,\) and \(k, N\) with k, N >= 1"):
        rk.Log("empty", np.zeros(shape[0]), *np.zeros((3, *shape)))


@pytest.mark.parametrize(
    ("t", "line", "words"), [("0 0.1 0.1 0.1", 4, r"0\.1 s comes 0\.1"), ("0 1 5 4 5", 5, "5 s comes 4")]
)
def test_times_of_a_log_that_do_not_increase_are_no_gap(tmp_path, t, line, words):
    """Not even where the usual step is 0, or where a gap comes first."""
    rows = ["t in s,q1 measured in rad,q1 desired in rad,c1 in N m", *(f"{time},0,0,0" for time in t.split())]
    (tmp_path / "own.csv").write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(ValueError, match=rf"line {line}, column 1: after {words} s; allowed: times that increase$"):
        rk.read_log(tmp_path / "own.csv")


def test_a_gap_of_a_log_is_half_a_step_too_long(tmp_path):
    t = np.array([0.0, 0.01, 0.02, 0.03, 0.044])
    rk.write_log(rk.Log("late", t, *np.zeros((3, 5, 3))), tmp_path / "late.csv")
    assert rk.read_log(tmp_path / "late.csv").t[-1] == 0.044
    t = np.array([0.0, 0.25, 0.5, 0.75, 1.125])  # 1.5 steps to the last bit: only what is over it is a gap
    rk.write_log(rk.Log("late", t, *np.zeros((3, 5, 3))), tmp_path / "late.csv")
    assert rk.read_log(tmp_path / "late.csv").t[-1] == 1.125
    t = np.array([0.0, 0.01, 0.02, 0.03, 0.047])
    with pytest.raises(ValueError, match=r"line 6, column 1: after 0\.03 s"):
        rk.write_log(rk.Log("gap", t, *np.zeros((3, 5, 3))), tmp_path / "gap.csv")


def test_every_key_of_every_table_is_tried():
    assert {t: set(keys) for t, keys in GOOD.items()} == {t: set(k) for t, k in UNITS_OF.items() if t != "fault"}
    assert {"kind"}.union(*FAULTS.values()) == set(UNITS_OF["fault"])


@pytest.mark.parametrize(("table", "key"), KEYS)
def test_a_unit_is_checked_and_named(said, table, key):
    for unit in ("'furlong'", "''", "3", "['m']", "true", "'M'"):
        sentence = said(text({(table, key): f"{{value = {GOOD[table][key]}, unit = {unit}}}"}))
        assert f"{key} in [{table}] has the unit" in sentence and repr(UNITS_OF[table][key]) in sentence, sentence


@pytest.mark.parametrize("kind", FAULTS)
def test_a_unit_of_a_fault_is_checked_and_named(said, kind):
    for key in FAULTS[kind]:
        entries = FAULTS[kind] | {key: f"{{value = {FAULTS[kind][key]}, unit = 'furlong'}}"}
        more = f"[[fault]]\nkind = '{kind}'\n" + "".join(f"{k} = {v}\n" for k, v in entries.items())
        assert f"{key} in [fault] has the unit 'furlong'" in said(text(more=more))
    more = f"[[fault]]\nkind = {{value = '{kind}', unit = 's'}}\n"
    assert "kind in [[fault]] has the unit 's', but is a word; allowed: " in said(text(more=more))


@pytest.mark.parametrize(
    ("key", "unit", "other"), [("jump", "rad", "mrad"), ("limit", "N m", "N"), ("time", "s", "ms")]
)
def test_numbers_of_faults_are_in_si_units(tmp_path, key, unit, other):
    file = tmp_path / "mine.toml"
    file.write_text(f"[[fault]]\n{key} = {{value = 0.5, unit = '{unit}'}}\n", encoding="utf-8")
    assert read_toml(file)["fault"][0][key] == 0.5
    file.write_text(f"[[fault]]\n{key} = {{value = 0.5, unit = '{other}'}}\n", encoding="utf-8")
    with pytest.raises(ValueError, match=f"{key} in .* has the unit '{other}'; allowed: '{unit}'"):
        read_toml(file)


@pytest.mark.parametrize(("table", "key"), KEYS)
def test_a_wrong_value_names_its_key(said, table, key):
    for value in WRONG:
        if key in ("angle", "offset") and value == "-1e99":
            continue  # whatever is finite is an angle
        sentence = said(text({(table, key): value}))
        assert re.search(rf"\b{key}\b", sentence), (value, sentence)


@pytest.mark.parametrize(("table", "key"), KEYS)
def test_an_entry_beside_the_value_is_named(said, table, key):
    assert f"entry of {key} in [{table}] 'origin'" in said(text({(table, key): "{value = 1.0, origin = 'me'}"}))
    assert f"{key} in [{table}]" in said(text({(table, key): "{unit = 'm'}"}))


@pytest.mark.parametrize(
    ("table", "key"),
    [("manipulator", k) for k in ("base", "lengths", "masses")] + [("control", "K_P"), ("control", "K_D")],
)
def test_a_missing_key_is_named(said, table, key):
    assert re.search(rf"\[{table}\].* lacks '{key}'; needed", said(text(without=[(table, key)])))


def test_missing_and_unknown_tables(said):
    assert "lacks 'base'" in said(text(table_without=["manipulator"]))
    for table in ("control", "path"):
        assert f"lacks the table [{table}]" in said(text(table_without=[table]))
    assert "did you mean 'sensor'?" in said(text(more="[sensors]\noffset = 0.0"))
    assert "unknown TOML table" in said(text(more='["a\\u0000b/../c"]\nx = 1'))
    for table in GOOD:
        assert table in said(text(table_without=[table], more=f"[[{table}]]\nx = 1"))
        assert table in said(text(table_without=[table], more="").join([f"{table} = 3\n", ""]))
        assert "unknown TOML key" in said(
            text(table_without=[table], more=f"[{table}]\nside_length = 1" + _needed(table))
        )
    for fault in ("fault = 3", "fault = [3]", "[fault]\nkind = 'DeadDrive'", "[[fault]]", "[[fault]]\nkind = 'Fire'",
                  "[[fault]]\nkind = 3", "[[fault]]\nkind = 'DeadDrive'\ndrive = 1",
                  "[[fault]]\nkind = 'DeadDrive'\ndrive = 1\ntime = 0.1\nplace = 2"):  # fmt: skip
        words = text(more=fault) if fault.startswith("[") else f"{fault}\n{text()}"
        assert "fault" in said(words).lower() or "DeadDrive" in said(words)


def _needed(table):
    """The keys without which a table is refused before its unknown key is seen."""
    return "".join(f"\n{k} = {v}" for k, v in GOOD[table].items() if table in ("manipulator", "control"))


@pytest.mark.parametrize(
    "words",
    [b"", b"\x00", b"\xff\xfe\x00", "a = ".encode("utf-16"), b"[manipulator", b"a = 1\na = 2", b"a = " + b"9" * 5000,
     b"a = " + b"[" * 5000, b"a = " + b"{a = " * 3000, b"[" + b"a." * 5000 + b"a]\nb = 1",
     b"name = 3\n", b"about = []\n"],
    ids=range(12),
)  # fmt: skip
def test_what_is_no_experiment_at_all(said, words):
    said(words)


@pytest.mark.parametrize(
    "name",
    ["../data/testbed", "/etc/passwd", "testbed/../testbed", "./testbed", "mystery_runs/gain", "", ".", "..", "a\0b",
     "~", "testbed\0", "file:///testbed", "x" * 10_000, "testbed.toml/..", "con", "TESTBED ", "\n", "{}", "table1.csv"],
    ids=range(19),
)  # fmt: skip
def test_a_name_stays_in_the_data_folder(name):
    for read in (rk.load, rk.experiment):
        with pytest.raises(ValueError, match=r"source = .*there is no data file .*; allowed: a name from") as caught:
            read(name)
        assert len(str(caught.value)) < 700
    with pytest.raises(ValueError, match=r"name = .*there is no data file .*; allowed: a file name"):
        rk.data_path(name if name != "table1.csv" else "table1")


@pytest.mark.parametrize("source", ["a\0b.toml", "nowhere/mine.toml", "x" * 5000 + ".toml", ".toml"], ids=range(4))
def test_a_path_that_cannot_be_read(source):
    for read in (rk.load, rk.experiment):
        with pytest.raises(ValueError, match=r"source: the file .* cannot be read \(.+\); allowed: a TOML file"):
            read(source)


def test_a_path_ends_in_toml(tmp_path):
    for name in ("mine.txt", "mine", "mine.toml.bak", "mine.TOML"):
        path = tmp_path / name
        path.write_text(text(), encoding="utf-8")
        for source in (path, str(path)):
            with pytest.raises(ValueError, match="there is no data file"):
                rk.load(source)
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ValueError, match=r"source: the file .* cannot be read"):
        rk.load(tmp_path / "folder.toml")
    assert rk.load(Path(rk.data_path("testbed.toml"))) == rk.load()


@pytest.mark.parametrize("t", [[0.0, 0.1, 0.1], [0.0, 0.1, 0.05]])
def test_no_two_records_of_a_log_have_one_time(t):
    with pytest.raises(ValueError, match=rf"t\[2\] = {t[2]:g} s follows 0\.1 s; allowed: increasing"):
        rk.Log("mine", t, *np.zeros((3, 3, 3)))


@pytest.mark.parametrize(
    ("t", "q_a", "others", "words"),
    [
        ((3, 1), (3, 3), (3, 3), r"t has shape \(3, 1\) and q_a \(3, 3\); allowed: \(k,\) and \(k, N\)"),
        ((2,), (3, 3), (3, 3), r"t has shape \(2,\) and q_a \(3, 3\); allowed: \(k,\) and \(k, N\)"),
        ((3,), (3, 1, 3), (3, 1, 3), r"q_a \(3, 1, 3\); allowed: \(k,\) and \(k, N\)"),
        ((3,), (3, 3), (3, 2), r"q_a_desired has shape \(3, 2\); allowed: \(3, 3\), as q_a"),
    ],
)
def test_columns_of_a_log_fit_together(t, q_a, others, words):
    with pytest.raises(ValueError, match=words):
        rk.Log("odd", np.arange(np.prod(t)).reshape(t), np.zeros(q_a), np.zeros(others), np.zeros(others))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with a name and devices are files of Unix")
def test_a_log_may_come_through_a_pipe_and_a_device_without_end_is_none(tmp_path):
    pipe = tmp_path / "gain.csv"
    os.mkfifo(pipe)
    writer = Thread(target=rk.write_log, args=(rk.mystery_run("gain"), pipe), daemon=True)
    writer.start()
    assert rk.read_log(pipe) == rk.mystery_run("gain")
    writer.join()
    with pytest.raises(ValueError, match=r"the log '/dev/zero' cannot be read \(.*\); allowed: a CSV file"):
        rk.read_log("/dev/zero")


def test_lists_of_a_log_are_kept_as_arrays_that_nobody_writes_into():
    log = rk.Log("lists", [0, 1], *np.zeros((3, 2, 3)).tolist())
    for column in (log.t, log.q_a, log.q_a_desired, log.c):
        assert column.dtype == float and not column.flags.writeable


def test_a_log_that_cannot_be_read_says_why(tmp_path):
    with pytest.raises(ValueError, match=rf"cannot be read \({os.strerror(errno.ENOENT)}\); allowed: a CSV file"):
        rk.read_log(tmp_path / "missing.csv")
    latin, long = tmp_path / "latin.csv", tmp_path / "long.csv"
    latin.write_bytes("t in s, Kräfte".encode("latin-1"))
    with pytest.raises(ValueError, match=r"cannot be read \(not UTF-8 text\)"):
        rk.read_log(latin)
    long.write_text("0" * (csv.field_size_limit() + 1))
    with pytest.raises(ValueError, match=r"cannot be read \(field larger than field limit"):
        rk.read_log(long)
    with pytest.raises(ValueError, match=rf"cannot be written \({os.strerror(errno.ENOENT)}\); allowed: a CSV file"):
        rk.write_log(rk.mystery_run("gain"), tmp_path / "missing" / "mine.csv")


def dimension(unit):
    """Powers of kg, m, s and A in a unit, (4,)."""
    kg, m, s, ampere = np.eye(4)
    base = {"kg": kg, "m": m, "s": s, "A": ampere, "rad": 0 * m, "1": 0 * m}
    base |= {"N": kg + m - 2 * s, "ohm": kg + 2 * m - 3 * s - 2 * ampere}
    parts = [(sign, part) for sign, side in zip((1, -1), unit.split("/"), strict=False) for part in side.split()]
    powers = [(sign, *part.partition("^")[::2]) for sign, part in parts]
    return sum(sign * int(power or 1) * base[word] for sign, word, power in powers)


def test_units_of_a_data_file_are_coherent_and_have_no_prefix():
    """SI: power R (c / k_t)^2 in W and energy f_c q in J come out without a factor; none is milli, degree or hour."""
    of = {key: dimension(unit) for keys in UNITS_OF.values() for key, unit in keys.items() if unit}
    expected = {
        "m": ("base", "lengths", "centers", "side", "centre"),
        "s": ("dt", "duration", "rest", "velocity_filter", "time", "start", "stop"),
        "kg": ("masses", "load"),
        "N m": ("friction", "limit", "K_P"),
        "N m s": ("K_D",),
        "N m s^2": ("inertias", "rotor_inertia"),
        "N m/A": ("torque_constant",),
        "1/s": ("friction_velocity",),
        "m/s^2": ("gravity",),
        "1": ("offset", "jump", "angle", "encoder", "drive", "mode"),
    }
    for unit, keys in expected.items():
        for key in keys:
            assert np.array_equal(of.get(key, np.zeros(4)), dimension(unit)), key
    heat = of["resistance"] - 2 * of["torque_constant"] + 2 * dimension("N m")
    assert np.array_equal(heat, dimension("N m/s"))
