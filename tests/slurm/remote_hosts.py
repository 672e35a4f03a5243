"""Hosts reachable by ssh: Debian's sshd on each node, with keys made for this test."""
import contextlib
import pathlib
import shutil
import subprocess

import cluster as engine

PORT = 2222


@contextlib.contextmanager
def daemons(cluster, folder):
    """Context in which the daemons run; yields the configuration for ssh's client."""
    keys = folder / "ssh"
    keys.mkdir(mode=0o700)
    for name in ("host", "user"):
        engine.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", keys / name)
    shutil.copy(keys / "user.pub", keys / "authorized")
    known = "".join(f"[{node.address}]:{PORT} {(keys / 'host.pub').read_text(encoding='ascii')}" for node in cluster.nodes)
    (keys / "known").write_text(known, encoding="ascii")
    # In a shared folder, since each node has its own /tmp.
    seen = cluster.shared / "ssh"
    shutil.copytree(keys, seen, dirs_exist_ok=True)
    configuration = seen / "sshd_config"
    configuration.write_text(f"Port {PORT}\nHostKey {seen}/host\nAuthorizedKeysFile {seen}/authorized\nStrictModes no\n"
                             "UsePAM no\nPasswordAuthentication no\nPermitRootLogin prohibit-password\nPidFile none\n",
                             encoding="ascii")
    pathlib.Path("/run/sshd").mkdir(exist_ok=True)
    started = []
    try:
        for node in cluster.nodes:
            started.append(subprocess.Popen(node.inside([shutil.which("sshd"), "-D", "-e", "-f", configuration]),
                                            stderr=open(seen / f"{node.name}.log", "wb")))
        engine.wait_for("sshd", lambda: all(node.run("ss", "-Hltn", f"sport = :{PORT}").stdout for node in cluster.nodes))
        yield {"Port": PORT, "IdentityFile": keys / "user", "UserKnownHostsFile": keys / "known", "User": "root"}
    finally:
        for daemon in started:
            daemon.terminate()
            daemon.wait()
