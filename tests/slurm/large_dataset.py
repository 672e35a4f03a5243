"""Makes a dataset whose archive has 50 MB: garage-small with a far-away tetrahedron whose file has a comment that
hardly compresses."""
import base64
import random
import shutil

ROCK = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PACKED_BYTES = 50_000_000


def make(source, folder):
    shutil.copytree(source, folder)
    noise = base64.b64encode(random.Random(1).randbytes(PACKED_BYTES)).decode()
    with open(folder / "rock.obj", "w", encoding="ascii") as rock:
        rock.write(ROCK)
        for i in range(0, len(noise), 998):
            rock.write("# " + noise[i:i + 998] + "\n")
    with open(folder / "scene.yaml", "a", encoding="utf-8") as scene:
        scene.write("  - {name: rock, shape: mesh, file: rock.obj, position: [500, 500, 1]}\n")
