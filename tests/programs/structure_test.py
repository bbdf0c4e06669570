"""What the design fixes about the code itself: who includes whom, what the programs link, sizes of files, no machine's paths."""

import pathlib
import re
import shutil
import subprocess

from harness import BIN, SOURCE, Skip, expect, main, need

CODE = ["formats", "voxelize", "simulate", "mapping", "flexel"]
STAGES = {"voxelize", "simulate", "mapping"}
HEAVY = re.compile(r"\b(assimp|CGAL|openvdb|embree3)/|<(png\.h|ft2build\.h)>|<[A-Z][A-Za-z0-9]*_?[A-Za-z0-9]*\.hxx>|<(gp|TopoDS|TopExp|BRep|Poly)\w*\.hxx>")
LIBRARIES = re.compile(r"lib(assimp|TK[A-Z]\w*|CGAL|openvdb|embree3|png16|freetype)\b")


def code_files(folder, *suffixes):
    return [p for p in sorted((SOURCE / folder).rglob("*")) if p.suffix in (suffixes or (".h", ".cpp"))]


def tracked_files():
    if shutil.which("git") is None or not (SOURCE / ".git").exists():
        raise Skip("not a git checkout")
    listed = subprocess.run(["git", "-c", f"safe.directory={SOURCE}", "ls-files", "-z"], cwd=SOURCE, check=True,
                            stdout=subprocess.PIPE).stdout
    return [SOURCE / name for name in listed.decode().split("\0") if name and (SOURCE / name).is_file()]


def included_folders(path):
    return set(re.findall(r'^\s*#\s*include\s+["<](\w+)/', path.read_text(encoding="utf-8"), re.M))


def test_stages_do_not_include_each_other():
    allowed = {"formats": {"formats"}, "flexel": set(CODE)}
    allowed.update({stage: {"formats", stage} for stage in STAGES})
    wrong = [f"{path.relative_to(SOURCE)} includes {sorted(bad)}" for folder in CODE for path in code_files(folder)
             if (bad := (included_folders(path) & set(CODE)) - allowed[folder])]
    expect(not wrong, "\n".join(wrong))
    expect(sum(len(code_files(folder)) for folder in CODE) > 40, "the test looks at the wrong folder")


def test_heavy_libraries_stay_in_source_files():
    headers = [path for folder in CODE for path in code_files(folder, ".h")]
    wrong = [str(path.relative_to(SOURCE)) for path in headers if HEAVY.search(path.read_text(encoding="utf-8"))]
    wrong += [str(path.relative_to(SOURCE)) for path in headers
              if re.search(r"#include <(nlohmann|toml)", path.read_text(encoding="utf-8"))]
    # A glTF file is its JSON: this header is between its reader and its writer, and nobody else's.
    wrong.remove("formats/gltf/gltf_content.h")
    expect(not wrong, f"headers that show a heavy library: {wrong}")
    users = [str(path.relative_to(SOURCE)) for folder in CODE for path in code_files(folder)
             if '#include "formats/gltf/gltf_content.h"' in path.read_text(encoding="utf-8")]
    expect(users == ["formats/gltf/gltf_content.cpp", "formats/gltf/write_gltf.cpp", "formats/gltf/read_gltf.cpp"],
           f"formats/gltf/gltf_content.h is for glTF alone: {users}")


def test_a_type_has_one_definition():
    """All folders share one namespace and one program links them all: two types of one name would share their vectors' code."""
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
    expect(users == ["base/parallel.h"], f"oneTBB belongs into base/parallel.h alone: {users}")


def test_light_programs_link_no_heavy_library():
    need("ldd")
    for program in ["flexel-simulate", "flexel-map"]:
        linked = subprocess.run(["ldd", BIN / program], check=True, stdout=subprocess.PIPE).stdout.decode()
        expect("libstdc++" in linked, f"ldd says nothing of {program}: {linked}")
        expect(not LIBRARIES.search(linked), f"{program} links {LIBRARIES.findall(linked)}")


def test_files_are_short():
    long = {}
    for path in tracked_files():
        if path.suffix in {".h", ".cpp", ".py", ".sh", ".cmake"} or path.parent.name == "tools":
            count = len(path.read_text(encoding="utf-8").splitlines())
            if count > 400:
                long[str(path.relative_to(SOURCE))] = count
    expect(not long, f"files of more than 400 lines: {long}")


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
