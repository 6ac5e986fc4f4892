# SPDX-License-Identifier: MIT
"""The page in a browser, wide and narrow, with clicks on its controls. Screenshots go to STIRPOST_SHOTS."""

import os
import re
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
import synthetic

from stirpost import cli
from stirpost.analysis import cooling, summary, surface
from stirpost.plots import curves, maps, solid
from stirpost.run import Run

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
FLAGS = ("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    directory = synthetic.make_run(tmp_path_factory.mktemp("runs") / "plate.out", spacing=0.002, frames=4)
    synthetic.write_tools(directory)
    synthetic.write_summary(directory, version="0.1.0", commit="abc", finished="2030-01-02 03:04", ranks=2, wall_seconds=90.0,
                            hottest_over_melting_K=12.0, melted_share_max=0.001)
    (directory / "plate_input.nml").write_text("&RUN TITLE = 'A plate''s pass' /\n&TIME\n  END = 12 ! <s>\n  ! default: STEPS_SAFETY = 0.5\n/\n")
    assert cli.main(["report", str(directory)]) == 0
    return directory


def test_head_process_and_size(run):
    """Title, where it comes from, what the process asks by phase with the warning beside it; nothing from elsewhere."""
    text = (run / "report" / "report.html").read_text()
    assert len(text.encode()) < 5e6
    body = re.sub(r"<script>.*?</script>", "", text, flags=re.S)
    assert "<h1>A plate&#39;s pass</h1>" in body
    for part in ("run plate", "2030-01-02 03:04", "Stirpoint 0.1.0, commit abc", "2 ranks", "computed in 90 s"):
        assert part in body
    assert re.search(r"<tr class=warned><td>peak temperature \[K\]</td>[^\n]*\n[^\n]*hotter than its melting point", body)
    assert 'class="alarms"' not in body  # all that is wrong stands beside what it is about
    assert not re.search(r'(src|href)="(?!data:|#)', body)


def test_the_process_table_has_means_and_peaks_of_each_phase(run):
    headings, rows = summary.process_table(Run(run))
    assert headings == ["travel", "whole run"]
    found = {name: values for name, values, _ in rows}
    mean, peak = (float(x) for x in found["axial force [kN], mean; peak"][0].split(";"))
    assert 7.0 < mean < 8.2 and 8.2 < peak < 9.5
    assert set(found) >= {"time [s]", "peak temperature [K]", "torque [N m], mean; peak", "power [kW], mean; peak"}


def test_the_input_stands_there_with_its_defaults(run, tmp_path):
    """As the run has resolved it; the input in the frames where that file is missing."""
    text = (run / "report" / "report.html").read_text()
    assert "END = 12 ! &lt;s&gt;\n  ! default: STEPS_SAFETY = 0.5" in text and "OMEGA = 800.0" not in text
    bare = synthetic.make_run(tmp_path / "bare.out", spacing=0.004, frames=1)
    assert Run(bare).resolved_text == Run(bare).input_text != ""


def test_sections_and_top_views_go_through_the_tool(run):
    there = Run(run)
    scene = maps.build_scene(there, there.frames[-1:])
    (top,), (cross,) = scene.top[0].tool, scene.cross[0].tool
    assert np.hypot(*(top - [0.08, 0.02]).T) == pytest.approx(synthetic.SHOULDER, rel=1e-3)
    assert np.ptp(cross[:, 0]) == pytest.approx(2 * synthetic.SHOULDER, rel=1e-2)
    assert cross[:, 1].min() == pytest.approx(synthetic.SIZE[2] - 1e-3, abs=1e-6)


def test_measured_thermocouples(run, tmp_path, capsys):
    """A record 5 K below the run: dots in the picture, and the difference on the page; other names are refused."""
    probes = Run(run).probes
    lines = [f"{t},{v - 278.15}" for t, v in zip(probes["time"][::5], probes["T1"][::5])]
    (tmp_path / "measured.csv").write_text("time[s],T1[C]\n" + "\n".join(lines) + "\n")
    record = cooling.Record.read(tmp_path / "measured.csv")
    ((_, values),) = curves.differences(probes, record)
    assert values.startswith("+5.0 K; 5.0 K; ")
    dots = [line for line in curves.thermocouples(probes, record).axes[0].lines if line.get_marker() == "."]
    assert len(dots) == 1 and dots[0].get_ydata() == pytest.approx(probes["T1"][::5] - 5.0)
    with pytest.raises(ValueError, match="no thermocouple"):
        curves.differences(probes, cooling.Record(record.time, ["X"], record.values))


def test_thinned_meshes_keep_their_shape_and_fields(monkeypatch):
    points = synthetic.lattice(0.001, (0.03, 0.02, 0.01))
    mesh = surface.reconstruct(points, 0.001, {"x": points[:, 0]})
    monkeypatch.setattr(solid, "MOST_TRIANGLES", len(mesh.corners) // 3)
    fewer = solid.thinned(mesh)
    assert len(fewer.corners) <= solid.MOST_TRIANGLES
    assert fewer.to_pyvista().volume == pytest.approx(mesh.to_pyvista().volume, rel=0.02)
    assert fewer["x"] == pytest.approx(fewer.points[:, 0], abs=0.0012)


@pytest.fixture(params=[1400, 420])
def browser(request, tmp_path):
    if not (BROWSER and DRIVER):
        pytest.skip("no chromium and chromedriver here")
    webdriver = pytest.importorskip("selenium.webdriver")
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for flag in (*FLAGS, f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={request.param},1000"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": request.param, "height": 1000, "deviceScaleFactor": 1, "mobile": False})
    driver.set_script_timeout(60)
    yield driver, request.param
    driver.quit()


def pixels(driver):
    """Colours of a coarse copy of the view that turns."""
    return driver.execute_script("""
        const from = document.querySelector('.solid canvas'), to = document.createElement('canvas');
        to.width = 60; to.height = 30;
        to.getContext('2d').drawImage(from, 0, 0, 60, 30);
        return Array.from(to.getContext('2d').getImageData(0, 0, 60, 30).data);""")


def test_the_page_in_a_browser(run, browser):
    """No error; the view shows metal, changes with time, colours, tool and when it is turned; nothing is wider than the
    window; the input opens."""
    driver, width = browser
    driver.get((run / "report" / "report.html").as_uri())
    assert driver.execute_script("return document.documentElement.scrollWidth") <= width
    smallest = driver.execute_script("""
        const sizes = [...document.querySelectorAll('td, th, p, a, h1, h2, figcaption, li')].map(e => parseFloat(getComputedStyle(e).fontSize));
        return Math.min(...sizes);""")
    assert smallest >= 13
    shown = driver.execute_script("return [...document.querySelectorAll('figure img')].map(e => e.getBoundingClientRect().width)")
    assert min(shown) >= min(600, width)   # labels in pictures stay legible
    seen = [pixels(driver)]
    assert np.std(np.reshape(seen[0], (-1, 4)), axis=0).max() > 20
    assert driver.find_element("css selector", ".time").text == "t = 12.00 s"
    slider = driver.find_element("css selector", ".solid input[type=range]")
    driver.execute_script("arguments[0].value = 1; arguments[0].dispatchEvent(new Event('input'))", slider)
    assert driver.find_element("css selector", ".time").text == "t = 4.00 s"
    seen.append(pixels(driver))
    driver.find_element("css selector", ".solid input[type=checkbox]").click()
    seen.append(pixels(driver))
    driver.execute_script("const s = document.querySelector('.solid select'); s.value = 1; s.dispatchEvent(new Event('change'))")
    seen.append(pixels(driver))
    canvas = driver.find_element("css selector", ".solid canvas")
    from selenium.webdriver import ActionChains

    ActionChains(driver).click_and_hold(canvas).move_by_offset(80, 20).release().perform()
    seen.append(pixels(driver))
    for before, after in zip(seen, seen[1:]):
        assert np.abs(np.subtract(before, after)).max() > 10
    driver.find_element("css selector", ".play").click()
    time.sleep(0.8)
    assert driver.find_element("css selector", ".time").text != "t = 4.00 s"
    driver.find_element("css selector", ".play").click()
    details = driver.find_element("css selector", "details summary")
    driver.execute_script("arguments[0].scrollIntoView()", details)
    details.click()
    assert driver.find_element("css selector", "details pre").is_displayed()
    errors = [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
    assert not errors
    if "STIRPOST_SHOTS" in os.environ:
        driver.execute_script("window.scrollTo(0, 0)")
        folder = Path(os.environ["STIRPOST_SHOTS"])
        folder.mkdir(parents=True, exist_ok=True)
        driver.save_screenshot(str(folder / f"page_{width}.png"))
