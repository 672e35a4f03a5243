"""Environments in which programs are started. Each changes one thing that shells, batch systems, containers or other
users determine. A Surrounding prepares the process (between fork and exec), the variables and the folder of a run."""
import os
import resource
import signal
import stat

PROBABLE_LIMIT = "ulimit"  # in the message of everything refused by a limit


class Surrounding:
    """The usual environment. `cause`: regular expression that the message of a run must match if its exit code differs
    from the usual one; empty: the code must not differ. `codes`: the allowed codes in that case."""

    cause = ""
    codes = ()
    signals = ()       # that may end a run without leaving anything behind
    keeps = frozenset()  # patterns of files from which a run that was stopped here continues
    side_files = False   # whether readers leave the log's index and an empty log: SQLite's index needs 32 KiB
    in_tmpdir = frozenset()  # patterns of files that belong into TMPDIR
    mute = False       # standard error is closed
    needs_root = False
    services = True    # whether servers and workers are tried as well

    def __init__(self, name):
        self.name = name

    def prepare(self):
        """Runs in the child."""

    def variables(self, usual):
        return usual

    def folder(self, folder):
        """Prepares the working folder of a run."""
        return folder

    def wrap(self, command):
        """Returns the command line that starts `command`."""
        return command


class Closed(Surrounding):
    def __init__(self, descriptors):
        super().__init__("closed_" + "".join(map(str, descriptors)))
        self.descriptors = descriptors
        self.mute = 2 in descriptors
        if 1 in descriptors:
            self.cause, self.codes = "standard output cannot be written", (2,)

    def prepare(self):
        for number in self.descriptors:
            os.close(number)


class ReaderGone(Surrounding):
    """The reader of these descriptors, e.g. `head`, has closed the pipe."""

    cause, signals = "standard output", (signal.SIGPIPE,)
    keeps = {r"generated\.partial"}

    def __init__(self, descriptors):
        super().__init__("reader_gone_" + "".join(map(str, descriptors)))
        self.descriptors = descriptors

    def prepare(self):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # Python ignores it
        reading, writing = os.pipe()
        os.close(reading)
        for number in self.descriptors:
            os.dup2(writing, number)
        os.close(writing)


class Limited(Surrounding):
    def __init__(self, name, limit, amount, cause, codes, hard=None):
        super().__init__(name)
        self.limit, self.amount, self.hard = limit, amount, amount if hard is None else hard
        self.side_files = limit == resource.RLIMIT_FSIZE and amount < 32 << 10
        self.cause, self.codes = cause, codes

    def prepare(self):
        resource.setrlimit(self.limit, (self.amount, self.hard))


class LimitedProcesses(Limited):
    """Runs as a separate user, since root has no such limit."""

    needs_root = True

    def __init__(self, amount):
        self.user = 54321 + amount  # the limit is on all processes of a user, and environments run at the same time
        super().__init__(f"processes_{amount}", resource.RLIMIT_NPROC, amount, "Resource temporarily unavailable", (71,))

    def folder(self, folder):
        for place, _, files in os.walk(folder):
            os.chmod(place, 0o777)
            for name in files:
                os.chmod(os.path.join(place, name), 0o666)
        return folder

    def prepare(self):
        os.setgroups([])
        os.setgid(self.user)
        os.setuid(self.user)
        super().prepare()


class Ignored(Surrounding):
    def __init__(self, name, signals):
        super().__init__("ignored_" + name)
        self.signals = signals

    def prepare(self):
        for number in self.signals:
            signal.signal(number, signal.SIG_IGN)


class Blocked(Surrounding):
    def prepare(self):
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())


class Mounted(Surrounding):
    """Runs in a mount namespace."""

    needs_root = True

    def __init__(self, name, script, cause="", codes=()):
        super().__init__(name)
        self.script, self.cause, self.codes = script, cause, codes

    def wrap(self, command):
        return ["unshare", "-m", "sh", "-c", f'{self.script} && exec "$@"', "sh", *command]


class Variables(Surrounding):
    in_tmpdir = {rf"legopt-{os.getuid()}"}  # the cache of datasets, without a home

    def __init__(self, name, change, keep=True):
        super().__init__(name)
        self.change, self.keep = change, keep

    def variables(self, usual):
        kept = dict(usual) if self.keep else {"LEGOPT_PORT": usual["LEGOPT_PORT"]}
        kept.update({name: text for name, text in self.change.items() if text is not None})
        for name in [name for name, text in self.change.items() if text is None]:
            kept.pop(name, None)
        return kept


class RemovedFolder(Surrounding):
    cause, codes = "the working directory was removed", (2,)

    def prepare(self):
        gone = os.path.join(os.getcwd(), "gone")
        os.mkdir(gone)
        os.chdir(gone)
        os.rmdir(gone)


class LeftoverFiles(Surrounding):
    """Files left by killed programs, and links planted by another user."""

    def folder(self, folder):
        for name in ("report.html.new", "solutions.json.new", "small.sqlite.lock", "copy.sqlite.partial-1"):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write("process 1 on elsewhere\n")
        return folder


class Inherited(Surrounding):
    """Started by a program that leaves many files open."""

    def prepare(self):
        for _ in range(200):
            os.set_inheritable(os.dup(0), True)


class Shifted(Surrounding):
    """A wrong clock, set by a library that the dynamic linker loads first."""

    def __init__(self, name, seconds, library, cause="", codes=()):
        super().__init__("clock_" + name)
        self.seconds, self.library, self.cause, self.codes = seconds, library, cause, codes

    def variables(self, usual):
        return {**usual, "LD_PRELOAD": self.library, "LEGOPT_TEST_CLOCK_SHIFT_S": str(self.seconds)}


class Masked(Surrounding):
    def prepare(self):
        os.umask(0o077)


class Redirected(Surrounding):
    def __init__(self, name, path, cause, codes):
        super().__init__(name)
        self.path, self.cause, self.codes = path, cause, codes

    def prepare(self):
        output = os.open(self.path, os.O_WRONLY)
        os.dup2(output, 1)
        os.close(output)


def all_surroundings(clock_library):
    """Returns every environment, the usual one first."""
    kib = 1024
    descriptors, file_size = resource.RLIMIT_NOFILE, resource.RLIMIT_FSIZE
    endless = resource.getrlimit(descriptors)[1]
    hour_s = 3600
    list_of = [Surrounding("usual")]
    list_of += [Closed([n for n in range(3) if closed >> n & 1]) for closed in range(1, 8)]
    list_of += [Limited(f"file_size_{size}_KiB", file_size, size * kib, "ulimit -f|standard output cannot be written", (2, 6))
                for size in (0, 1, 4, 16, 64, 128, 256, 512, 1024, 4096)]
    list_of += [Limited(f"descriptors_{n}", descriptors, n, "ulimit -n", (71,)) for n in (6, 10, 20, 40)]
    list_of += [Limited("descriptors_soft_64", descriptors, 64, "", (), endless)]
    list_of += [Limited(f"memory_{mib}_MiB", resource.RLIMIT_AS, mib << 20, "[Mm]emory|allocate|failed to map|ulimit -v", (71, 127))
                for mib in (64, 160, 300)]
    list_of += [LimitedProcesses(n) for n in (0, 2)]
    names = {"HUP": [signal.SIGHUP], "INT": [signal.SIGINT], "CHLD": [signal.SIGCHLD], "PIPE": [signal.SIGPIPE],
             "USR": [signal.SIGUSR1, signal.SIGUSR2], "TERM": [signal.SIGTERM], "XFSZ": [signal.SIGXFSZ]}
    list_of += [Ignored(name, signals) for name, signals in names.items()]
    list_of += [Ignored("all", sorted(signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP}))]
    list_of += [Blocked("blocked_signals")]
    list_of += [ReaderGone([1]), ReaderGone([1, 2])]
    list_of += [Mounted("no_proc", "mount -t tmpfs none /proc"), Mounted("no_sys", "mount -t tmpfs none /sys"),
                Mounted("no_dev_null", "mount -t tmpfs none /dev", "/dev/null", (71,)),
                Mounted("read_only_folder", 'mount --bind "$PWD" "$PWD" && mount -o remount,ro,bind "$PWD" && cd "$PWD"',
                        "[Rr]ead-only|readonly|unable to open|cannot be (written|created|made)|cannot open", (2, 6))]
    list_of += [Variables("no_home", {"HOME": None}), Variables("empty_environment", {}, keep=False),
                Variables("home_is_missing", {"HOME": "/dev/null/missing"}), Variables("home_is_a_file", {"HOME": "/dev/null"}),
                Variables("foreign_locale", {"LC_ALL": "de_DE.UTF-8", "LANG": "tr_TR.UTF-8"}),
                Variables("unknown_locale", {"LC_ALL": "xx_YY.nonsense"}), Variables("dumb_terminal", {"TERM": "dumb"}),
                Variables("large_environment", {f"FILLER_{i}": "x" * 4000 for i in range(100)})]
    list_of += [RemovedFolder("removed_folder"), LeftoverFiles("leftover_files"), Inherited("inherited_files"),
                Masked("umask_077"),
                Redirected("full_output", "/dev/full", "standard output cannot be written|No space left", (2,))]
    if clock_library:
        list_of += [Shifted("before_1970", -100 * 365 * 24 * hour_s, clock_library, "clock", (2, 71)),
                    Shifted("of_2099", 75 * 365 * 24 * hour_s, clock_library),
                    Shifted("an_hour_late", -hour_s, clock_library)]
    return list_of


def is_regular(path):
    return stat.S_ISREG(os.lstat(path).st_mode)
