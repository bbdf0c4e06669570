"""Man pages and completions (tools/interface-files) say what --help says, and complete what a user would type."""

import gzip
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import time

from harness import BIN, SOURCE, Skip, ascii_stl, box_triangles, expect, expect_error, expect_ok, main, run, shell

SHARE = pathlib.Path("share")
STAGES = ["flexel-voxelize", "flexel-simulate", "flexel-map"]


def make():
    expect_ok(run("/usr/bin/python3", "-B", SOURCE / "tools/interface-files", BIN, SHARE))


def commands():
    listed = expect_ok(run("flexel", "--describe-arguments")).out.decode().splitlines()
    return [line.split("\t")[1] for line in listed]


def completions(line):
    """What bash offers at the end of `line`, whose last word is the one to complete ("" after a blank)."""
    script = f"""source share/bash-completion/completions/flexel
    eval "COMP_WORDS=({line})"; [[ "{line[-1]}" != " " ]] || COMP_WORDS+=("")
    COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _flexel "${{COMP_WORDS[0]}}"; printf '%s\\n' "${{COMPREPLY[@]}}" """
    return [word for word in expect_ok(shell(script)).out.decode().splitlines() if word]


def test_every_option_of_help_is_in_its_man_page():
    make()
    for name in commands():
        help_text = expect_ok(run("flexel", name, "--help")).out.decode()
        page = gzip.decompress((SHARE / f"man/man1/{'flexel-' + name}.1.gz").read_bytes()).decode().replace("\\-", "-")
        for option in re.findall(r"^ +(?:-\w,)?(--[\w-]+)", help_text, re.MULTILINE):
            expect(f"\\fB{option}\\fR" in page, f"{option} is not in the page of flexel {name}")
    front = gzip.decompress((SHARE / "man/man1/flexel.1.gz").read_bytes()).decode()
    expect(all(f"flexel-{name}" in front.replace("\\-", "-") for name in commands()), front)


def test_man_pages_are_sound_roff():
    if not shutil.which("man"):
        raise Skip("no man")
    make()
    for page in sorted(SHARE.glob("man/man1/*.gz")):
        done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", str(page)], capture_output=True, text=True, check=False)
        expect(done.returncode == 0 and not done.stderr.strip(), f"{page}: {done.stderr}")


def test_bash_completes_commands_options_and_words():
    make()
    expect(completions("flexel de") == ["deform"], completions("flexel de"))
    expect(set(completions("flexel ")) >= set(commands()), completions("flexel "))
    expect("--material" in completions("flexel deform --ma"), completions("flexel deform --ma"))
    expect(completions("flexel deform a.stl --heal wr") == ["wrap"], completions("flexel deform a.stl --heal wr"))
    expect(completions("flexel-map --method sm") == ["smooth"], completions("flexel-map --method sm"))
    expect(completions("flexel map --method sm") == ["smooth"], completions("flexel map --method sm"))
    expect(set(completions("flexel deform --model ")) == {"cells", "quadratic", "springs", "paper"}, completions("flexel deform --model "))
    expect("mm" in completions("flexel info --unit "), completions("flexel info --unit "))


def test_bash_completes_materials_and_faces_of_the_part():
    make()
    pathlib.Path("my part.stl").write_bytes(ascii_stl(box_triangles()))
    expect(completions("flexel deform x --material spring") == ["spring\\ steel"], completions("flexel deform x --material spring"))
    names = expect_ok(run("flexel", "info", "--words", "my part.stl")).out.decode().splitlines()
    expect("zmax" in names and any(name.endswith("/6") for name in names), names)
    offered = completions("flexel deform my\\ part.stl --fix ")
    expect(set(offered) == {name.replace(" ", "\\ ") for name in names}, offered)
    expect(completions("flexel deform my\\ part.stl --fix part/z") == ["part/zmax", "part/zmin"], offered)
    expect(completions("flexel deform my\\ part.stl --push zm") == ["zmax", "zmin"], completions("flexel deform my\\ part.stl --push zm"))
    expect_error(run("flexel", "info", "--words", "--json", "my part.stl"), "flexel", "excludes")
    expect_error(run("flexel", "info", "--words", "--thickness", "out.ply", "my part.stl"), "flexel", "excludes")


SHELLS = {"bash": (["bash", "--norc", "--noprofile", "-i"], ". share/bash-completion/completions/flexel"),
          "zsh": (["zsh", "-f", "-i"], "unsetopt prompt_cr prompt_sp; PS1='> '; bindkey -e; fpath=(share/zsh/vendor-completions $fpath); "
                                       "autoload -Uz compinit; compinit -u -D")}


class TypedShell:
    """An interactive shell, and what it makes of a line and a tab."""

    def __init__(self, program):
        command, preparation = SHELLS[program]
        self.child, self.terminal = pty.fork()
        if self.child == 0:
            os.environ.update(PATH=f"{BIN}:{os.environ['PATH']}", TERM="dumb", INPUTRC="/dev/null")
            os.execvp(command[0], command)
        os.write(self.terminal, f"{preparation}; echo rea''dy\n".encode())

    def __enter__(self):
        self.wait_for(b"ready\r\n")
        return self

    def __exit__(self, *_):
        os.kill(self.child, signal.SIGKILL)
        os.waitpid(self.child, 0)
        os.close(self.terminal)

    def wait_for(self, wanted):
        said, until = b"", time.monotonic() + 20
        while wanted not in said:
            expect(time.monotonic() < until, f"{wanted} is missing in {said}")
            if select.select([self.terminal], [], [], 0.5)[0]:
                said += os.read(self.terminal, 4096)

    def expect(self, line, *words):
        """These words are what it has made of `line` and a tab."""
        os.write(self.terminal, line.encode() + b"\t")
        time.sleep(0.2)
        os.write(self.terminal, b"\x01printf '<%s>' \n")  # Ctrl-A: the words of the line are printed
        self.wait_for("".join(f"<{word}>" for word in words).encode())


def test_an_interactive_bash_quotes_once():
    make()
    pathlib.Path("my part.stl").write_bytes(ascii_stl(box_triangles()))
    with TypedShell("bash") as bash:
        bash.expect("flexel deform --material spri", "flexel", "deform", "--material", "spring steel")
        bash.expect("flexel info my", "flexel", "info", "my part.stl")


def test_an_interactive_bash_within_quotation_marks_and_after_equals():
    """--push "zmax: 0 0 -100 N" has blanks, so that its user begins with the mark."""
    make()
    pathlib.Path("part.stl").write_bytes(ascii_stl(box_triangles()))
    with TypedShell("bash") as bash:
        for line, word in (('flexel deform part.stl --push "zma', "zmax"), ("flexel deform part.stl --push 'zma", "zmax"),
                           ('flexel deform part.stl --material "spri', "spring steel")):
            bash.expect(line, "flexel", "deform", "part.stl", "--" + line.split("--")[1].split()[0], word)
        for option, word in (("--fix=zma", "--fix=zmax"), ("--material=spri", "--material=spring steel"), ("--heal=wr", "--heal=wrap")):
            bash.expect(f"flexel deform part.stl {option}", "flexel", "deform", "part.stl", word)


def test_bash_completes_kinds_of_files():
    make()
    for name in ("a.step", "B.STL", "c.vtu", "d.toml", "e.txt"):
        pathlib.Path(name).touch()
    pathlib.Path("folder").mkdir()
    for line, wanted in (("flexel info ", ["B.STL", "a.step", "folder", "share"]), ("flexel deform a.step --scene ", ["d.toml", "folder", "share"]),
                         ("flexel simulate ", ["c.vtu", "d.toml", "folder", "share"]), ("flexel map ", ["c.vtu", "folder", "share"]),
                         ("flexel info e", ["e.txt"]), ("flexel materials ", []), ("flexel export --mesh ", ["hex", "tet"]),
                         ("flexel export --nlgeom ", ["auto", "off", "on"]), ("flexel-simulate --isa ", ["avx2", "avx512", "portable"]),
                         ("flexel voxelize --align ", ["box", "none", "snap"])):
        found = sorted(completions(line))
        expect(found == wanted, f"{line}: {found}")
    found = completions("flexel map --format ")
    expect({"step", "iges", "stl", "3mf", "vtu"} <= set(found), found)


def test_an_interactive_zsh():
    if not shutil.which("zsh"):
        raise Skip("no zsh")
    make()
    pathlib.Path("my part.stl").write_bytes(ascii_stl(box_triangles()))
    pathlib.Path("my scene.toml").touch()
    with TypedShell("zsh") as zsh:
        zsh.expect("flexel deform --material spri", "flexel", "deform", "--material", "spring steel")
        zsh.expect("flexel info my", "flexel", "info", "my part.stl")
        zsh.expect("flexel deform my\\ part.stl --fix zma", "flexel", "deform", "my part.stl", "--fix", "zmax")
        zsh.expect("flexel deform my\\ part.stl --scene my", "flexel", "deform", "my part.stl", "--scene", "my scene.toml")
        zsh.expect("flexel export --mesh h", "flexel", "export", "--mesh", "hex")
        zsh.expect("flexel-map --method sm", "flexel-map", "--method", "smooth")
        zsh.expect('flexel deform my\\ part.stl --push "zma', "flexel", "deform", "my part.stl", "--push", "zmax")
        for option, word in (("--fix=zma", "--fix=zmax"), ("--material=spri", "--material=spring steel"), ("--heal=wr", "--heal=wrap")):
            zsh.expect(f"flexel deform my\\ part.stl {option}", "flexel", "deform", "my part.stl", word)


def offered_by_fish(line):
    script = f"set PATH {BIN} $PATH; source {SHARE}/fish/vendor_completions.d/flexel.fish; complete -C '{line}'"
    return [row.split("\t")[0] for row in expect_ok(run("fish", "-N", "-c", script)).out.decode().splitlines()]


def test_fish_completes_faces_materials_and_files():
    if not shutil.which("fish"):
        raise Skip("no fish")
    make()
    pathlib.Path("a.stl").write_bytes(ascii_stl(box_triangles()))
    for name in ("b.txt", "c.toml"):
        pathlib.Path(name).touch()
    expect(offered_by_fish("flexel deform a.stl --fix zm") == ["zmax", "zmin"], offered_by_fish("flexel deform a.stl --fix zm"))
    expect("part/6" in offered_by_fish("flexel deform a.stl --push pa"), offered_by_fish("flexel deform a.stl --push pa"))
    expect("spring steel" in offered_by_fish("flexel deform a.stl --material spr"), offered_by_fish("flexel deform a.stl --material spr"))
    expect(offered_by_fish("flexel info ")[0] == "a.stl", offered_by_fish("flexel info "))
    expect(offered_by_fish("flexel deform a.stl --scene ")[0] == "c.toml", offered_by_fish("flexel deform a.stl --scene "))
    expect(set(offered_by_fish("flexel export --mesh ")) == {"hex", "tet"}, offered_by_fish("flexel export --mesh "))
    expect("mm" in offered_by_fish("flexel info --unit "), offered_by_fish("flexel info --unit "))
    expect(offered_by_fish('flexel deform a.stl --push "zm') == ["zmax", "zmin"], offered_by_fish('flexel deform a.stl --push "zm'))
    expect(offered_by_fish("flexel deform a.stl --fix=zm") == ["--fix=zmax", "--fix=zmin"], offered_by_fish("flexel deform a.stl --fix=zm"))


def test_other_shells_read_theirs():
    make()
    missing = [shell_name for shell_name in ("zsh", "fish") if not shutil.which(shell_name)]
    for program, path in (("zsh", "zsh/vendor-completions/_flexel"), ("fish", "fish/vendor_completions.d/flexel.fish")):
        if program not in missing:
            expect_ok(run(program, "-n", SHARE / path))
    if len(missing) == 2:
        raise Skip("neither zsh nor fish")


if __name__ == "__main__":
    main(globals())
