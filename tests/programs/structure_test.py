"""What the design fixes about the code itself: who includes whom, what the programs link, sizes, no machine's paths."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from harness import BIN, SOURCE, Skip, expect, main, need

CODE = ["base", "formats", "meshes", "voxelize", "simulate", "distributed", "mapping", "cad", "flexel", "python"]

# Every folder of the code, each after those that it may include: docs/development.md says what they hold.
ORDER = """
base base/math base/files base/program
formats/part formats/common formats/stl formats/obj formats/ply formats/off formats/gltf formats/threemf formats/cad formats/vdb formats/assimp
formats/vtu formats/lattice formats/pieces formats/exchange
meshes
voxelize/types voxelize/mesh voxelize/distances voxelize/classify voxelize/heal voxelize/lattice voxelize/slabs voxelize
simulate/laws simulate/input simulate/result simulate/linear simulate/state simulate/rigid simulate/conditions simulate/models
simulate/kernels simulate/matter simulate/gravitation simulate/contact/points simulate/contact/pairs simulate/contact simulate/followers simulate/effects simulate/thermal simulate/paper simulate/joints simulate/indent simulate/events simulate/scene
simulate/equilibrium simulate/estimate simulate/probes simulate/quadratic/cells simulate/quadratic simulate/conduction simulate/live simulate/stepping simulate/implicit simulate/time simulate/modes simulate
distributed
mapping/types mapping/anchors mapping/checks mapping/methods mapping/space mapping/crack mapping/report mapping/refine mapping
cad/read cad/fit cad/deform cad
flexel/process flexel/picture/canvas flexel/picture/render flexel/picture flexel/view flexel/clay flexel/study/runs flexel/study flexel/export flexel/lammps
flexel/measure flexel/accuracy flexel/compensate flexel/flex flexel
python
""".split()
STAGES = {"voxelize", "simulate", "mapping"}
HEAVY = re.compile(r"\b(assimp|CGAL|openvdb|embree3)/|<(png\.h|ft2build\.h|microhttpd\.h)>|<[A-Z][A-Za-z0-9]*_?[A-Za-z0-9]*\.hxx>|<(gp|TopoDS|TopExp|BRep|Poly)\w*\.hxx>")
LIBRARIES = re.compile(r"lib(assimp|TK[A-Z]\w*|CGAL|openvdb|embree3|png16|freetype)\b")


def code_files(folder, *suffixes):
    return [p for p in sorted((SOURCE / folder).rglob("*")) if p.suffix in (suffixes or (".h", ".cpp"))]


def tracked_files():
    if shutil.which("git") is None or not (SOURCE / ".git").exists():
        raise Skip("not a git checkout")
    listed = subprocess.run(["git", "-c", f"safe.directory={SOURCE}", "ls-files", "-z"], cwd=SOURCE, check=True,
                            stdout=subprocess.PIPE).stdout
    return [SOURCE / name for name in listed.decode().split("\0") if name and (SOURCE / name).is_file()]


def included(path):
    """The headers of ours that a file includes, from the root."""
    return re.findall(r'^\s*#\s*include\s+"((?:%s)/[^"]+)"' % "|".join(CODE), path.read_text(encoding="utf-8"), re.M)


def test_folders_include_only_those_before_them():
    """No cycle between folders, and stages that never include each other, for ORDER is one line."""
    place = {folder: n for n, folder in enumerate(ORDER)}
    wrong, seen = [], set()
    for path in (path for folder in CODE for path in code_files(folder)):
        folder = str(path.parent.relative_to(SOURCE))
        seen.add(folder)
        if folder not in place:
            wrong.append(f"{folder} is not in ORDER")
            continue
        for header in included(path):
            other = header.rsplit("/", 1)[0]
            if not (SOURCE / header).exists():  # made by the build
                continue
            stages = {folder.split("/")[0], other.split("/")[0]} & STAGES
            if place.get(other, len(ORDER)) > place[folder] or (len(stages) == 2 and folder.split("/")[0] in STAGES):
                wrong.append(f"{path.relative_to(SOURCE)} includes {header}")
    expect(not wrong, "\n".join(wrong))
    expect(seen == set(ORDER), f"folders of ORDER without files: {set(ORDER) - seen}")


def test_files_do_not_include_each_other():
    """Units (a header with its .cpp): no cycle between them."""
    unit = lambda name: re.sub(r"\.(h|cpp)$", "", name)
    edges = {}
    for path in (path for folder in CODE for path in code_files(folder)):
        own = unit(str(path.relative_to(SOURCE)))
        edges.setdefault(own, set()).update(unit(h) for h in included(path) if unit(h) != own)
    done, on_way = set(), []

    def visit(name):
        if name in on_way:
            return on_way[on_way.index(name):]
        if name in done:
            return None
        on_way.append(name)
        for other in sorted(edges.get(name, ())):
            if found := visit(other):
                return found
        on_way.pop()
        done.add(name)
        return None

    sys.setrecursionlimit(10000)
    for name in sorted(edges):
        found = visit(name)
        expect(not found, f"a cycle of includes: {found}")


def test_source_files_have_a_header():
    """Going to the header of a file works: it has the same name, or the file's begins with it (stepper_memory.cpp, stepper.h)."""
    # What a reader or a writer of one format gives is declared for all of them together.
    shared = re.compile(r"formats/\w+/(read_\w+|write_\w+|refine_\w+|\w+_format|cad_readers)\.cpp$|cad/read/(\w+_reader|occt_mesh)\.cpp$|/main\.cpp$|/\w+_command\.cpp$")
    wrong = []
    for path in (path for folder in CODE for path in code_files(folder, ".cpp")):
        stems = [header.stem for header in path.parent.glob("*.h")]
        if not any(path.stem == stem or path.stem.startswith(stem + "_") for stem in stems) and not shared.search(str(path)):
            wrong.append(str(path.relative_to(SOURCE)))
    expect(not wrong, f"files without a header of their name: {wrong}")


def blocks(lines, indent):
    """(first line, line of the brace, last line) of what is in braces at this indent; clang-format has laid it out."""
    pad, i = " " * indent, 0
    while i < len(lines):
        line = lines[i]
        if line.startswith(pad) and len(line) > indent and line[indent] not in " }/#":
            j = i
            # a function of one line ends in "}"
            while j < len(lines) and not lines[j].rstrip().endswith(("{", ";", "}")):
                j += 1
            if j < len(lines) and lines[j].rstrip().endswith("{"):
                k = j + 1
                while k < len(lines) and not lines[k].startswith(pad + "}"):
                    k += 1
                if re.match(r"\s*(namespace|extern)\b", line):
                    i = j + 1
                    continue
                yield i, j, k
                i = k + 1
                continue
            i = j + 1
            continue
        i += 1


def is_type(head):
    return re.search(r"^(template <.*> )?(struct|class|union)\b", head) and "(" not in head.split("final")[0]


def members(lines):
    """How many data members a type has whose body these lines are."""
    count = 0
    for line in lines:
        code = line.split("//")[0].rstrip()
        if re.match(r"  [A-Za-z_].*;$", code) and "(" not in code.split("=")[0] and \
                not re.match(r"  (using|friend|static|enum|struct|class|return|public|typedef)\b", code):
            count += 1 if "<" in code else 1 + code.split("{")[0].split("=")[0].count(",")
    return count


def test_functions_and_types_are_small():
    """At most 60 lines a function, 25 data members a type, 25 files a folder."""
    long, wide, functions = [], [], 0
    for path in (path for folder in CODE for path in code_files(folder)):
        name, lines = path.relative_to(SOURCE), path.read_text(encoding="utf-8").split("\n")
        for first, brace, last in blocks(lines, 0):
            head = " ".join(line.strip() for line in lines[first:brace + 1])
            inside = []
            if is_type(head):
                if members(lines[brace + 1:last]) > 25:
                    wide.append(f"{name}:{first + 1}: {members(lines[brace + 1:last])} data members")
                inside = [(brace + 1 + a, brace + 1 + c) for a, b, c in blocks(lines[brace + 1:last], 2)
                          if "(" in " ".join(lines[brace + 1 + a:brace + 2 + b])]
            elif "(" in head:
                inside = [(first, last)]
            functions += len(inside)
            # A hot loop's body is one function: its parts share registers, and `if constexpr` leaves most lines out.
            most = 80 if name.parent.name == "kernels" else 60
            long += [f"{name}:{a + 1}: {c - a + 1} lines" for a, c in inside if c - a + 1 > most]
    full = [str(folder) for folder in ORDER if len([p for p in (SOURCE / folder).glob("*") if p.suffix in (".h", ".cpp")]) > 25]
    expect(functions > 3000, f"the test sees only {functions} functions")
    expect(not long, "functions of more than 60 lines:\n" + "\n".join(long))
    expect(not wide, "types of more than 25 members:\n" + "\n".join(wide))
    expect(not full, f"folders of more than 25 files: {full}")


def test_heavy_libraries_stay_in_source_files():
    # cad/ is the program that OpenCASCADE is for: nobody else includes its headers.
    headers = [path for folder in CODE for path in code_files(folder, ".h") if folder != "cad"]
    users = [str(path.relative_to(SOURCE)) for folder in CODE if folder != "cad" for path in code_files(folder)
             if '#include "cad/' in path.read_text(encoding="utf-8")]
    expect(not users, f"cad/ is included from outside: {users}")
    wrong = [str(path.relative_to(SOURCE)) for path in headers if HEAVY.search(path.read_text(encoding="utf-8"))]
    wrong += [str(path.relative_to(SOURCE)) for path in headers
              if re.search(r"#include <(nlohmann|toml|CLI)", path.read_text(encoding="utf-8"))]
    # A glTF file is its JSON: this header is between its reader and its writer, and nobody else's.
    wrong.remove("formats/gltf/gltf_content.h")
    # Between nlohmann's library and source files.
    wrong.remove("base/files/json.h")
    users = [str(path.relative_to(SOURCE)) for path in headers if '#include "base/files/json.h"' in path.read_text(encoding="utf-8")]
    expect(not users, f"headers that show JSON: {users}")
    expect(not wrong, f"headers that show a heavy library: {wrong}")
    users = [str(path.relative_to(SOURCE)) for folder in CODE for path in code_files(folder)
             if '#include "formats/gltf/gltf_content.h"' in path.read_text(encoding="utf-8")]
    expect(users == ["formats/gltf/gltf_content.cpp", "formats/gltf/read_gltf.cpp", "formats/gltf/refine_gltf.cpp",
                     "formats/gltf/write_gltf.cpp"],
           f"formats/gltf/gltf_content.h is for glTF alone: {users}")


def test_a_type_has_one_definition():
    """One program links them all: two types of one name in one namespace would share their vectors' code."""
    places = {}
    for path in (path for folder in CODE for path in code_files(folder)):
        scope, hidden = "", False
        for line in path.read_text(encoding="utf-8").splitlines():
            if opened := re.match(r"namespace ([\w:]*)\s*{", line):
                hidden, scope = not opened[1], scope + opened[1]
            elif re.match(r"}\s*// namespace$", line):
                hidden = False
            elif not hidden and (found := re.match(r"(?:struct|class|enum class) (\w+)(?: final)?(?: :.*)? {", line)):
                places.setdefault(scope + "::" + found[1], set()).add(str(path.relative_to(SOURCE)))
    expect(len(places) > 200, "the test sees no types")
    twice = {name: sorted(files) for name, files in places.items() if len(files) > 1}
    expect(not twice, f"types that are defined more than once: {twice}")


def test_only_one_file_uses_tbb():
    users = [str(path.relative_to(SOURCE)) for folder in CODE for path in code_files(folder)
             if re.search(r"#include <(oneapi/)?tbb", path.read_text(encoding="utf-8"))]
    expect(sorted(users) == ["base/math/parallel_sort.h", "base/parallel.cpp"], f"oneTBB belongs behind base/parallel.h and into base/math/parallel_sort.h: {users}")


def test_light_programs_link_no_heavy_library():
    need("ldd")
    for program in ["flexel-simulate", "flexel-map"]:
        linked = subprocess.run(["ldd", BIN / program], check=True, stdout=subprocess.PIPE).stdout.decode()
        expect("libstdc++" in linked, f"ldd says nothing of {program}: {linked}")
        expect(not LIBRARIES.search(linked), f"{program} links {LIBRARIES.findall(linked)}")
    # OpenCASCADE and assimp are loaded by flexel-cad and flexel-meshes, OpenVDB by a module, each where it is needed.
    for program in ["flexel", "flexel-voxelize"]:
        linked = subprocess.run(["ldd", BIN / program], check=True, stdout=subprocess.PIPE).stdout.decode()
        expect(not re.search(r"lib(TK|assimp|openvdb|microhttpd)", linked), f"{program} links what takes long to load: {linked}")


def test_no_path_of_one_machine():
    # In two pieces, so that this file is not its own finding.
    pattern = re.compile("/" + r"(work|root|home)/|\.lib" + r"rary\b|\.py" + "env")
    wrong = []
    for path in tracked_files():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        wrong += [f"{path.relative_to(SOURCE)}:{n}: {line.strip()}" for n, line in enumerate(text.splitlines(), 1)
                  if pattern.search(line)]
    expect(not wrong, "\n".join(wrong))


def test_sources_open_with_a_comment():
    wrong = [str(path.relative_to(SOURCE)) for folder in CODE for path in code_files(folder)
             if not path.read_text(encoding="utf-8").startswith("//")]
    expect(not wrong, f"files that do not say what they are: {wrong}")


def test_what_names_its_interpreter_can_be_run():
    scripts = [path for path in tracked_files() if path.read_bytes()[:2] == b"#!"]
    expect(len(scripts) > 20, f"{len(scripts)} scripts")
    wrong = [str(path.relative_to(SOURCE)) for path in scripts if not os.access(path, os.X_OK)]
    expect(not wrong, f"scripts that the shell refuses to run (chmod +x): {wrong}")


def test_changelog_names_this_version():
    version = re.search(r"project\(flexel VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    expect(f"\n## {version}" in (SOURCE / "CHANGELOG.md").read_text(encoding="utf-8"), f"CHANGELOG.md lacks {version}")


def test_links_in_the_documentation_lead_somewhere():
    wrong = []
    for page in [p for p in tracked_files() if p.suffix == ".md"]:
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if "://" not in target and not (page.parent / target).exists():
                wrong.append(f"{page.relative_to(SOURCE)}: {target}")
    expect(not wrong, "\n".join(wrong))
    expect(pathlib.Path(SOURCE / "docs/README.md").exists(), "docs/README.md is missing")


if __name__ == "__main__":
    main(globals())
