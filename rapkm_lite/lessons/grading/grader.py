"""Grade a folder of submissions: a process for each, started again without what hangs or dies in it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from ..checker import exercises
from .submission import Submission, found

# Starts of one submission at most, each without what the one before hung in; bytes that are copied for each at most.
_STARTS, _MOST = 8, 10**8
_ORDER = ("ok", "close", "wrong", "todo")


@dataclass(frozen=True)
class Grade:
    """One exercise of one student."""

    student: str
    exercise: str
    verdict: str
    points: float
    of: float
    sentence: str
    mistake: str
    file: str = ""


def grade(
    folder: Path, seconds: float = 30.0, jobs: int | None = None, progress: Callable | None = None
) -> list[Grade]:
    """Grades of all submissions under a folder, sorted by student and exercise.

    Of several notebooks of a student for one lesson the one with most points counts, of equal ones the newest.
    seconds : limit of each statement and each check; a whole notebook gets ten times as much, and once more
    that where all of it is run after an answer came out wrong.
    jobs : submissions graded at a time; None: as many as there are processors.
    progress : called with (done, all, submission) after each one.
    Ctrl-C, or an error of `progress`, ends what runs; nothing more is begun.
    Raises ValueError when the folder holds no submissions or `seconds` or `jobs` is not positive.
    """
    if not seconds > 0.0:
        raise ValueError(f"seconds = {seconds!r}; allowed: a positive number")
    jobs = (os.cpu_count() or 1) if jobs is None else jobs
    if jobs < 1:
        raise ValueError(f"jobs = {jobs!r}; allowed: 1 or more")
    submissions = found(folder, {name[:2] for name in exercises()})
    best: dict[tuple[str, str], tuple] = {}
    stop = Event()
    with ThreadPoolExecutor(jobs) as pool:
        running = {pool.submit(grade_one, submission, seconds, stop): submission for submission in submissions}
        try:
            for done, future in enumerate(as_completed(running), 1):
                one, grades = running[future], future.result()
                rank = sum(g.points for g in grades), _age(one.path), str(one.path)
                kept = best.get((one.student, one.lesson))
                best[one.student, one.lesson] = max(kept, (rank, grades)) if kept else (rank, grades)
                if progress:
                    progress(done, len(submissions), one)
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)
    return sorted((g for _, grades in best.values() for g in grades), key=lambda g: (g.student, g.exercise))


def _age(path: Path) -> float:
    """When a file was changed, s; 0.0 where it is gone, or a link to nothing."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def grade_one(submission: Submission, seconds: float, stop: Event | None = None) -> list[Grade]:
    """Grades of one notebook, for every exercise of its lesson; nothing more is run once `stop` is set."""
    stop = stop or Event()
    results, hidden = _results(submission, seconds, stop, whole=False)
    again = [word for word, _, mistake in results.values() if mistake != "cannot be read"]
    if "wrong" in again or (hidden and "todo" in again):
        # Something that an answer uses, or what checks it, may not have been among the statements chosen for it.
        for name, one in _results(submission, seconds, stop, whole=True)[0].items():
            results[name] = min(results.get(name, one), one, key=lambda result: _ORDER.index(result[0]))
    grades = []
    for name, exercise in exercises().items():
        if name.startswith(f"{submission.lesson}."):
            word, sentence, mistake = results.get(name, ("wrong", "the notebook could not be run to here", "not run"))
            of = float(exercise.points)
            points = of if word in ("ok", "close") else 0.0
            grades.append(Grade(submission.student, name, word, points, of, sentence, mistake, str(submission.path)))
    return grades


def _results(
    submission: Submission, seconds: float, stop: Event, whole: bool
) -> tuple[dict[str, tuple[str, str, str]], bool]:
    """Verdict, sentence and mistake by exercise, from as many starts as it takes; True where a check may be hidden."""
    skip: list[str] = []
    hidden = False
    results: dict[str, tuple[str, str, str]] = {}
    ends = time.monotonic() + 10 * seconds
    for _ in range(_STARTS):
        stopped = ""
        with tempfile.TemporaryDirectory() as place:
            for event in _events(submission, Path(place), seconds, ends, stop, whole, skip):
                if "result" in event:
                    name, word, sentence, mistake = event["result"]
                    results[name] = word, sentence, mistake
                hidden = event.get("hidden", hidden)
                stopped = event.get("begin", "" if "done" in event else stopped)
                if "trouble" in event:
                    lost = [n for n in exercises() if n.startswith(f"{submission.lesson}.") and n not in results]
                    return results | dict.fromkeys(lost, ("wrong", event["trouble"], "cannot be read")), hidden
        if not stopped or stop.is_set() or time.monotonic() > ends:
            break
        skip.append(stopped)
    return results, hidden


def _events(
    submission: Submission, place: Path, seconds: float, ends: float, stop: Event, whole: bool, skip: list[str]
) -> Iterator[dict]:
    """What a worker tells, until it is done, dies, or says nothing for longer than the limit."""
    log, work = place / "log.jsonl", place / "work"
    log.touch()
    _lend(submission, work)
    command = [sys.executable, "-m", "rapkm_lite.lessons.grading.worker", str(submission.path.resolve())]
    command += [submission.lesson, str(log), *(["--whole"] if whole else [])]
    command += [word for key in skip for word in ("--skip", key)]
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": (place / "errors").open("w")}
    worker = subprocess.Popen(command, cwd=work, env=_environment(), start_new_session=os.name == "posix", **quiet)
    heard, finished = time.monotonic(), False
    try:
        with log.open(encoding="utf-8") as lines:
            while not finished:
                over = worker.poll() is not None
                news = lines.readlines()
                for line in news:
                    heard = time.monotonic()
                    event = json.loads(line)
                    finished = finished or "done" in event
                    yield event
                now = time.monotonic()
                if over or stop.is_set() or now > ends or now - heard > seconds + 20.0 * (not log.stat().st_size):
                    break
                time.sleep(0.02)
        if not finished and not log.stat().st_size:
            lines = (place / "errors").read_text(errors="replace").strip().splitlines() or ["nothing is said"]
            yield {"trouble": f"the notebook cannot be run: {lines[-1][:200]}"}
    finally:
        _end(worker)
        quiet["stderr"].close()


def _lend(submission: Submission, work: Path) -> None:
    """Copies, in a new folder, of the files that lie beside a notebook and in the folders there.

    Not of Python files, which the worker finds where they are, after those that are installed; nor of notebooks, of
    what is hidden, of links to folders and of what cannot be read or written.  Links instead to what would be too much.
    """
    work.mkdir()
    room = _MOST
    for place, folders, files in os.walk(submission.path.parent):
        # Beside a loose notebook a folder is another student's.
        folders[:] = [] if submission.loose else [one for one in folders if one[0] != "."]
        target = work / Path(place).relative_to(submission.path.parent)
        with suppress(OSError):  # where the disk is full, or the name would be too long
            target.mkdir(exist_ok=True)
        for file in (Path(place, one) for one in files):
            if file.name[0] != "." and file.suffix.lower() not in (".py", ".pyc", ".ipynb") and os.path.isfile(file):
                with suppress(OSError):
                    size = file.stat().st_size
                    (shutil.copyfile if size <= room else os.symlink)(file.resolve(), target / file.name)
                    room -= size * (size <= room)


def _environment() -> dict[str, str]:
    """One thread each, no screen, and the package that grades."""
    here = str(Path(__file__).parents[3])
    paths = [here, *filter(None, [os.environ.get("PYTHONPATH")])]
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    own = {"MPLBACKEND": "Agg", "PYTHONPATH": os.pathsep.join(paths), "RAPKM_LITE_STRICT": "0"}
    return os.environ | one | own


def _end(worker: subprocess.Popen) -> None:
    """End a worker and what it started."""
    if os.name == "posix":
        with suppress(ProcessLookupError):
            os.killpg(worker.pid, signal.SIGKILL)
    worker.kill()
    worker.wait()
