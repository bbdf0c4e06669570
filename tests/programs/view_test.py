"""flexel view from the outside: what it serves and what it refuses, the file that it writes, how it ends."""

import contextlib
import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import time
import urllib.parse

from harness import BIN, SCENE, body, box, bracket, expect, expect_error, expect_ok, expect_only, main, run, scene, write


def deformed(name="bent.vtu", *options):
    body("rest.vtu")
    expect_ok(run("flexel-simulate", scene(), "rest.vtu", "-o", name, *options))
    return name


@contextlib.contextmanager
def served(*arguments, program=BIN / "flexel"):
    """The URL that is printed, while the program runs."""
    process = subprocess.Popen([program, "view", *arguments, "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        line = process.stdout.readline().decode()
        expect(re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/\n", line), f"one line with the URL: {line!r}")
        yield urllib.parse.urlparse(line.strip()), process
    finally:
        process.kill()
        process.communicate()


def ask(url, path, method="GET", host=None, content=None, **headers):
    """Status, headers and bytes of an answer."""
    connection = http.client.HTTPConnection(url.hostname, url.port, timeout=10)
    connection.putrequest(method, path, skip_host=True)
    for name, value in {"Host": host or url.netloc, **headers}.items():
        connection.putheader(name, value)
    connection.endheaders(content)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def page_json(html):
    return json.loads(re.search(r'<script type="application/json" id="page">(.*?)</script>', html, re.S)[1])


def test_only_what_was_named_is_served():
    with served(deformed(), box()) as (url, _):
        status, headers, html = ask(url, url.path)
        expect(status == 200 and html.startswith(b"<!DOCTYPE html>"), f"the page: {status}")
        expect(headers["X-Content-Type-Options"] == "nosniff" and headers["Cache-Control"] == "no-store" and headers["X-Frame-Options"] == "DENY",
               f"{headers}")
        files = page_json(html.decode())["files"]
        expect([file["label"] for file in files] == ["bent.vtu", "box.stl"], f"{files}")
        for k, file in enumerate(files):
            status, _, data = ask(url, f"{url.path}data/{k}")
            expect(status == 200 and data[:4] == b"FLXV" and len(data) == file["bytes"], f"data {k}: {status}")
        for path in ("/", "/box.stl", url.path[:-1], url.path + "data/2", url.path + "data/", url.path + "box.stl", url.path + "../../etc/passwd",
                     url.path + "%2e%2e/box.stl", "/" + "0" * 32 + "/", url.path.upper(), url.path + "/"):
            expect(ask(url, path)[0] == 404, f"{path} should not be there")


def test_others_get_nothing():
    with served(box()) as (url, _):
        for headers in ({"host": "evil.example"}, {"host": f"evil.example:{url.port}"}, {"host": "127.0.0.1"}, {"Origin": "http://evil.example"},
                        {"Origin": "null"}, {"Origin": f"https://{url.netloc}"}, {"host": f"[::1]:{url.port}"}):
            status, _, content = ask(url, url.path, **headers)
            expect(status == 403 and b"DOCTYPE" not in content, f"{headers}: {status}")
        for headers in ({"host": f"localhost:{url.port}"}, {"Origin": f"http://{url.netloc}"}):
            expect(ask(url, url.path, **headers)[0] == 200, f"{headers}")
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "HEAD", "TRACE"):
            expect(ask(url, url.path, method, **{"Content-Length": "0"})[0] == 405, method)
        expect(ask(url, url.path, **{"X-Long": "x" * 40000})[0] == 431, "headers have a limit")
        expect(ask(url, "/" + "x" * 40000)[0] in (404, 414, 431), "so has the path")
        expect(ask(url, url.path)[0] == 200, "it still answers")


def test_idle_connections_lock_nobody_out():
    with served(box()) as (url, _):
        idle = [socket.create_connection((url.hostname, url.port)) for _ in range(40)]
        idle[0].sendall(b"GET / HTTP/1.1\r\n")  # and no more
        status, begin = None, time.monotonic()
        while status is None and time.monotonic() < begin + 15:  # half as long as a page may take
            try:
                status = ask(url, url.path)[0]
            except OSError:  # there is no room yet
                time.sleep(0.2)
        expect(status == 200, "the page is not answered")
        for connection in idle:
            connection.close()


def test_how_it_ends():
    for sent, code in ((signal.SIGINT, 130), (signal.SIGTERM, -signal.SIGTERM), (signal.SIGHUP, -signal.SIGHUP)):
        with served(box()) as (_, process):
            process.send_signal(sent)
            expect(process.wait(timeout=10) == code, f"{sent}: {process.returncode}")
            expect(b"error" not in process.stderr.read(), "no error is said")


def test_modules_are_found_where_they_are_installed():
    """In libexec/flexel, and readable only, as Debian has shared objects."""
    for folder, name, mode in (("bin", "flexel", 0o755), ("libexec/flexel", "flexel-serve.so", 0o644)):
        os.makedirs(folder)
        shutil.copyfile(BIN / name, f"{folder}/{name}")
        os.chmod(f"{folder}/{name}", mode)
    with served(box(), program=os.path.abspath("bin/flexel")) as (url, _):
        expect(ask(url, url.path)[0] == 200, "it serves")


def test_a_page_is_one_file():
    deformed("bent.vtu", "--summary", "summary.json")
    result = expect_ok(run("flexel", "view", "bent.vtu", "--html", "bent.html", "--summary", "summary.json"))
    expect(result.out == b"" and "bent.html:" in result.err, f"its size is said: {result}")
    html = open("bent.html", encoding="utf-8").read()
    expect(not re.search(r"(src|href)=[\"']?(https?:|//)", html.replace("https://www.w3.org", "")), "nothing is loaded from elsewhere")
    expect("connect-src 'none'" in html and "default-src 'none'" in html, "nor may it be")
    page = page_json(html)
    expect(page["whole"] and page["words"]["summary"]["program"] == "flexel-simulate", "what the run found is in it")
    expect(html.count('class="data"') == 1, "and the data")
    expect_ok(run("flexel", "view", "bent.vtu", "--html", "again.html", "--summary", "summary.json"))
    expect(open("again.html", "rb").read() == open("bent.html", "rb").read(), "the same bytes again")
    expect(expect_ok(run("flexel", "view", "bent.vtu", "--html", "-", "--summary", "summary.json")).out == html.encode(), "stdout gets the same")


def test_stdin():
    deformed()
    expect_ok(run("flexel", "view", "-", "--html", "body.html", stdin=open("bent.vtu", "rb").read()))
    expect_ok(run("flexel", "view", "-", "--html", "part.html", stdin=open(box(), "rb").read()))
    expect(page_json(open("part.html").read())["files"][0]["label"] == "stdin", "the name of stdin")
    expect_error(run("flexel", "view", "-", "--html", "none.html", stdin=b"solid"), "flexel", "stdin")
    expect_error(run("flexel", "view", "-", "-", "--html", "none.html"), "flexel", "stdin")


def test_refusals():
    deformed()
    box()
    os.mkdir("folder")
    os.mkdir("empty")
    write("list.json", "[1]")
    view = lambda *arguments: run("flexel", "view", *arguments)
    expect_error(view("box.stl", "--html", "box.png"), "flexel", "box.html")
    expect_error(view("box.stl", "--html", "box.html", "--limit", "0.1"), "flexel", "--limit", "100 kB")
    expect_error(view("box.stl", "--html", "box.html", "--limit", "nan"), "flexel", "--limit")
    expect_error(view("box.stl", "--html", "no/box.html"), "flexel", "no/box.html")
    expect_error(view("box.stl", "--html", "box.html", "--color", "qualty"), "flexel", "qualty", "box.stl")
    expect_error(view("bent.vtu", "--html", "box.html", "--color", "strian"), "flexel", "did you mean \"strain\"")
    expect_error(view("box.stl", "--html", "box.html", "--scale", "-1"), "flexel", "--scale")
    expect_error(view("box.stl", "--html", "box.html", "--summary", "list.json"), "flexel", "--summary")
    expect_error(view("folder"), "flexel", "folder", "study.html")
    expect_error(view("gone.stl"), "flexel", "gone.stl")
    expect_error(view("box.stl", "--cells", "box.stl", "--html", "bent.vtu"), "flexel", "html")
    expect_error(view(*["box.stl"] * 17), "flexel", "16")
    expect_error(view(), "flexel", "required")
    expect_only("bent.vtu", "box.stl", "empty", "folder", "list.json", "rest.vtu", "scene.toml")


def test_only_some_files_have_the_colours():
    deformed()
    box()
    for colour in ("displacement", "strain"):
        for files in (("box.stl", "bent.vtu"), ("bent.vtu", "box.stl")):
            expect_ok(run("flexel", "view", *files, "--color", colour, "--html", "both.html"))
            expect(page_json(open("both.html").read())["colour"] == colour, "it begins with them")
        expect_error(run("flexel", "view", "box.stl", "box.stl", "--color", colour, "--html", "none.html"), "flexel", "box.stl", colour)


def test_series():
    body("rest.vtu")
    scene("run.toml", SCENE + '[run]\ntime = "0.2 ms"\nframes = 4\n')
    expect_ok(run("flexel-simulate", "run.toml", "rest.vtu", "-o", "run.pvd"))
    expect_ok(run("flexel", "view", "run.pvd", "--html", "run.html"))
    expect_ok(run("flexel", "view", "run_00001.vtu", "--html", "frame.html"))  # by the surface of the first
    box()
    for shown, kind in (("run.pvd", "series"), ("box.stl", "part")):
        warned = expect_ok(run("flexel", "view", shown, "--cells", "--html", "cells.html", "--force")).err
        expect(f"warning: {shown}: --cells" in warned and kind in warned, warned)
    expect("warning" not in expect_ok(run("flexel", "view", "run_00001.vtu", "--cells", "--html", "cells.html")).err, "a body has cells")
    os.remove("run_00002.vtu")
    expect_error(run("flexel", "view", "run.pvd", "--html", "gone.html"), "flexel", "run_00002.vtu")
    write("bad.pvd", "<VTKFile/>")
    expect_error(run("flexel", "view", "bad.pvd", "--html", "gone.html"), "flexel", "bad.pvd", "series")


def test_deform_writes_a_page():
    bracket()
    run_deform = lambda *arguments: run("flexel", "deform", "bracket.step", "--fix", "bracket/1", "--push", "bracket/2: 0 0 -100 N",
                                        "--material", "PLA", "--size", "4 mm", *arguments)
    result = expect_ok(run_deform("--html", "bent.html", "-o", "bent.stl"))
    words = page_json(open("bent.html").read())["words"]
    for line in words["lines"]:
        expect(line in result.err, f"the page says what was said: {line}")
    expect(words["warnings"] and all(line in result.err for line in words["warnings"]), f"warnings too: {words['warnings']} of {result.err}")
    expect(any(line.startswith("how far") for line in words["lines"]), f"{words['lines']}")
    expect(words["summary"]["simulate"]["largest_displacement"] > 1e-3, "and the figures")
    expect_ok(run_deform("-o", "alone.html", "--quiet"))
    expect_error(run_deform("--html", "bent.page"), "flexel", "bent.html")
    expect_error(run_deform(), "flexel", "-o", "--html")


def test_a_page_that_is_too_large_does_not_take_the_result_along():
    columns = range(600)
    corners = [(x, y, z) for x in (0, 40) for y in (0, 10) for z in (0, 10)]
    quads = ["0 1 3 2", "4 6 7 5", "0 4 5 1", "2 3 7 6", "0 2 6 4", "1 5 7 3"]
    head = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {axis}" for axis in "xyz"), *(f"property float column{n}" for n in columns),
            "element face 6", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(str, [*corner, *(sum(corner) + n for n in columns)])) for corner in corners] + [f"4 {quad}" for quad in quads]
    write("box.ply", "\n".join(head + rows) + "\n")
    result = run("flexel", "deform", "box.ply", "--fix", "xmin", "--push", "xmax: 0 0 -100 N", "--material", "PLA", "--size", "5 mm", "--edge", "0.3 mm",
                 "--html", "large.html", "-o", "bent.stl", "--summary", "summary.json")
    expect_error(result, "flexel", "large.html", "50 MB", "-o OUT.vtu", "--limit")
    expect("how far" in result.err, f"the answer is said: {result}")
    expect_only("bent.stl", "box.ply", "summary.json")


if __name__ == "__main__":
    main(globals())
