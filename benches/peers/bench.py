"""Shared by all stages: the cases, forked measurements, JSON lines. README.md tells the environment variables."""
import json, math, os, re, signal, statistics, tempfile, time
import numpy as np

CASES = os.environ.get("CASES", "cases")
TMP = os.environ.get("PEERS_TMP") or tempfile.gettempdir()
REPEATS = int(os.environ.get("REPEATS", "3"))
TIMEOUT = int(os.environ.get("PEER_TIMEOUT", "300"))
ONLY = [s.strip().lower() for s in os.environ.get("PEERS_ONLY", "").split(",") if s.strip()]
LARGE = 100_000  # vertices; some peers would take hours beyond
LONG = 5         # seconds; a run this long needs no warm-up before it
ENOUGH = 20      # seconds; no further run starts after so many


def array(name, dtype="<f8"):
    return np.fromfile(f"{CASES}/{name}", dtype=dtype)


def points(name):
    return array(name).reshape(-1, 3)


def load(name):
    """A mesh: n x 3 float64 and faces x 3 int64."""
    return points(f"{name}.v.f64"), array(f"{name}.f.u32", "<u4").reshape(-1, 3).astype(np.int64)


def matrix(model):
    """B, the watermark matrix: 3n x m, by columns."""
    import scipy.sparse as sp
    p, i = (array(f"{model}.lsq.{k}", "<u8").astype(np.int64) for k in "pi")
    rows = os.path.getsize(f"{CASES}/{model}.lsq.r") // 8
    return sp.csc_matrix((array(f"{model}.lsq.x"), i, p), shape=(rows, len(p) - 1))


def keep(model, peer, v, f):
    """Leaves a simplified mesh in $PEERS_TMP, for the caller to score."""
    tag = f"{model}.{re.sub('[^a-z0-9]+', '-', peer.lower())}"
    np.ascontiguousarray(v, "<f8").tofile(f"{TMP}/{tag}.v.f64")
    np.ascontiguousarray(f, "<u4").tofile(f"{TMP}/{tag}.f.u32")
    return dict(score=tag)


def diag(v):
    return float(np.linalg.norm(v.max(0) - v.min(0)))


def version(package):
    from importlib import metadata
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "?"


def measure(stage, model, peer, package, body, repeats=REPEATS):
    """Prints the row of one peer. `body(timer)` runs in a process of its own, so that a crash, a hang and the memory
    are its alone; it times with `timer` and returns how good the answer is."""
    if ONLY and not any(s in peer.lower() for s in ONLY):
        return
    row = dict(stage=stage, model=model, peer=peer, version=version(package))
    r, w = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(r)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # some peers print; stdout is for rows
        try:
            signal.alarm(TIMEOUT)
            t = Timer(repeats)
            acc = body(t) or {}
            if bad := [k for k, x in acc.items() if isinstance(x, float) and not math.isfinite(x)]:
                raise ArithmeticError(f"{bad[0]} is not finite")
            row.update(median=statistics.median(t.wall), best=min(t.wall), cpu=statistics.median(t.cpu),
                       runs=len(t.wall), extra_mb=round(t.extra_kb / 1024, 1), acc=acc)
        except BaseException as e:  # a row for this peer, and the others go on
            row.update(error=f"{type(e).__name__}: {e}"[:160])
        os.write(w, json.dumps(row).encode())
        os._exit(0)
    os.close(w)
    with os.fdopen(r, "rb") as pipe:
        line = pipe.read().decode()
    status = os.waitpid(pid, 0)[1]
    if not line:
        killer = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
        why = f"over {TIMEOUT} s" if killer == signal.SIGALRM else f"killed by signal {killer}"
        row["error"] = why if killer else "died"
        line = json.dumps(row)
    print(line, flush=True)


def peak_kb():
    with open("/proc/self/status") as fh:
        return next(int(l.split()[1]) for l in fh if l.startswith("VmHWM"))


class Timer:
    """`for i in timer:` gives one run to warm up and then run 0, 1, ...; in each, `with timer:` is the timed part."""
    def __init__(self, repeats):
        self.repeats, self.wall, self.cpu, self.extra_kb = repeats, [], [], None

    def __iter__(self):
        yield 0
        if self.wall[0] < LONG:
            self.wall.clear(), self.cpu.clear()
        while len(self.wall) < self.repeats and sum(self.wall) < ENOUGH:
            yield len(self.wall)

    def __enter__(self):
        if self.extra_kb is None:
            try:
                with open("/proc/self/clear_refs", "w") as fh:
                    fh.write("5")  # the high-water mark falls to what is in use now
            except OSError:
                pass               # then the growth is a lower bound
            self._peak = peak_kb()
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    def __exit__(self, *error):
        self.wall.append(time.perf_counter() - self._wall)
        self.cpu.append(time.process_time() - self._cpu)
        if self.extra_kb is None:  # the first run: later ones reuse memory that the allocator kept
            self.extra_kb = peak_kb() - self._peak
