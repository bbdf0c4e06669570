"""bench/accuracy/experiments.py, which writes docs/measurements/experiments.md: its sources, its arithmetic, and its quickest experiment."""

import math
import os
import re
import sys

from harness import BIN, SOURCE, expect, main, run

sys.path.insert(0, str(SOURCE / "bench/accuracy"))
import experiments  # noqa: E402


def close(found, wanted, what):
    expect(abs(found - wanted) <= 1e-9 * max(1.0, abs(wanted)), f"{what}: {found} instead of {wanted}")


def test_every_measurement_says_where_it_is_from():
    files = {path.stem for path in (SOURCE / "bench/accuracy/measured").glob("*.toml")}
    expect(files == set(experiments.EXPERIMENTS), f"measured: {files}, computed: {set(experiments.EXPERIMENTS)}")
    for name in files:
        data = experiments.measured(name)
        expect(re.search(r"\b(1[89]|20)\d\d\b", data["source"]), f"{name}: no year in {data['source']}")
        expect("." in data["read"].split("/")[0], f"{name}: no address in {data['read']}")


def test_the_page_has_every_experiment():
    page = (SOURCE / "docs/measurements/experiments.md").read_text(encoding="utf-8")
    for name in experiments.EXPERIMENTS:
        data = experiments.measured(name)
        for field in ("title", "source", "read", "not_read", "what", "remarks"):
            expect(data[field] in page, f"docs/measurements/experiments.md has not what measured/{name}.toml says as {field}")
        expect(f"](experiments/{name}.svg)" in page and (SOURCE / f"docs/measurements/experiments/{name}.svg").exists(), f"no figure of {name}")


def test_a_rigid_motion_gives_back_its_velocity_and_spin():
    x, z, spin, reach = 1.5, -0.25, 300.0, 0.99 * 2.5e-3
    books = []
    for k in range(11):
        time = 1e-6 * k
        row = {"time [s]": time}
        for name, side in (("left", -1), ("right", 1)):
            row[f"{name} x [m]"] = x * time
            row[f"{name} z [m]"] = z * time - side * spin * reach * time  # about y, right-handed, small angles
        books.append(row)
    found = experiments.after_bounce(books, 3e-6)
    close(found[0], x, "along")
    close(found[1], z, "up")
    close(found[2], 2 * reach * spin, "spin")


def test_a_line_is_found_and_errors_are_of_their_series():
    start, slope, off = experiments.line_through([(x, 3 - 2 * x) for x in (0.0, 0.5, 2.0)])
    close(start, 3, "intercept")
    close(slope, -2, "slope")
    close(off, 0, "deviation")
    off = experiments.errors([("a", "1", 1.0, 1.0, 1.1), ("a", "2", -4.0, -4.4, -4.0), ("b", "1", 10.0, 10.0, 9.0)])
    for found, wanted in zip(off, ((10, 2.5, 2.5), (0, 0, 10), (-10, -10, -10)), strict=True):
        for one, other in zip(found, wanted, strict=True):
            close(one, other, "error")


def test_half_a_ball_is_closed():
    edges = {}
    volume = 0.0
    for a, b, c in experiments.half_ball(2.5, 0.1, 12):
        volume += sum(a[i] * (b[(i + 1) % 3] * c[(i + 2) % 3] - b[(i + 2) % 3] * c[(i + 1) % 3]) for i in range(3)) / 6
        for edge in ((a, b), (b, c), (c, a)):
            edges[edge] = edges.get(edge, 0) + 1
    expect(all(count == 1 and edges.get((b, a)) == 1 for (a, b), count in edges.items()), "an edge is not shared by two triangles")
    expect(0.9 < volume / (2 / 3 * math.pi * 2.5**3) < 1, f"volume {volume}")


def test_the_quickest_experiment():
    found = run(SOURCE / "bench/accuracy/experiments.py", "--only", "block", "-o", "page.md", env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
    expect(found.code == 0, found)
    with open("page.md", encoding="utf-8") as file:
        page = file.read()
    rows = re.findall(r"^\| frequency, mode \d+ \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([+-][\d.]+) \|$", page, re.M)
    expect(len(rows) == 40, page)
    for measured, _, ours, error in rows:
        expect(abs(100 * (float(ours) / float(measured) - 1) - float(error)) < 0.15, f"{measured}, {ours}: {error} %")
        expect(abs(float(error)) < 1, f"{measured} kHz is {error} % off")
    for figure in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page):
        expect(os.path.exists(figure), f"no figure {figure}")


def test_a_missing_program_is_one_line():
    found = run(SOURCE / "bench/accuracy/experiments.py", "--only", "block", "-o", "page.md", env={**os.environ, "PATH": "/usr/bin:/bin"})
    expect(found.code == 1 and len(found.err.splitlines()) == 1 and not os.path.exists("page.md"), found)


if __name__ == "__main__":
    main(globals())
