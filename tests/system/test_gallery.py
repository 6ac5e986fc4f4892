"""Pictures of the documents: each scene of docs/gallery.py has its picture, which is small; one is drawn here."""

import json
import re
import subprocess
import sys

import driver
import pytest
from PIL import Image

SCRIPT = driver.ROOT / "docs/gallery.py"
PICTURES = driver.ROOT / "docs/pictures"
sys.path.insert(0, str(SCRIPT.parent))
SCENES = ("quickstart", "copper", "pin", "shoulder", "butt", "dissimilar", "lap", "heat")


@pytest.mark.parametrize("name", SCENES)
def test_picture_is_there(name):
    """Shown once in the gallery, smaller than 200 kB, and not blank."""
    path = PICTURES / f"gallery_{name}.png"
    assert path.stat().st_size < 200_000
    with Image.open(path) as image:
        assert image.width >= 800 and len(image.convert("RGB").getcolors(1_000_000)) > 1000
    shown = re.findall(r"\]\(pictures/gallery_(\w+)\.png\)", (driver.ROOT / "docs/gallery.md").read_text(encoding="utf-8"))
    assert shown.count(name) == 1 and len(shown) == len(SCENES)


def test_pictures_are_of_the_shipped_inputs(tmp_path, monkeypatch):
    """Exact: each picture has the digest of its input as it is now; --stale lists those of another input, also where there is no git."""
    import gallery

    made = json.loads(gallery.MADE.read_text(encoding="utf-8"))
    assert sorted(made) == sorted(SCENES) == sorted(gallery.SCENES)
    assert not [name for name, of in made.items() if of["input"] != gallery.digest(gallery.SCENES[name][0])]
    copy = tmp_path / "pin.nml"
    for more, other in (("! a comment", False), ("&MORE /", True)):
        copy.write_text(gallery.SCENES["pin"][0].read_text(encoding="utf-8") + more, encoding="utf-8")
        monkeypatch.setitem(gallery.SCENES, "pin", (copy, 1.0))
        monkeypatch.setenv("PATH", "")
        listed = {line.split(" (")[0] for line in gallery.stale() if "another input" in line}
        assert listed == ({"pin"} if other else set())
        monkeypatch.undo()


def test_a_run_that_is_there_is_drawn(run, tmp_path, monkeypatch):
    """From a finished run, which is not computed again."""
    pytest.importorskip("pyvista")
    run(driver.ROOT / "share/stirpoint/new/shoulder.nml", "--quiet", sets={"TIME.MAX_STEPS": 20})
    made = tmp_path / "picture.png"
    code = (f"import sys; sys.path.insert(0, {str(SCRIPT.parent)!r}); import gallery, pathlib; "
            f"o = gallery.argparse.Namespace(runs=pathlib.Path({str(tmp_path)!r}), ranks='1', stirpoint=pathlib.Path('/none')); "
            f"run = gallery.computed(gallery.SCENES['shoulder'][0], o); "
            f"gallery.save(gallery.draw(run, 0.0, 'shoulder'), pathlib.Path({str(made)!r}))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    with Image.open(made) as image:
        assert image.width == 900
