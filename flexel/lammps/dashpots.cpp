// The Python text. It finds LAMMPS's library interface in the process itself and needs numpy.
#include "flexel/lammps/dashpots.h"

#include "base/files/append_text.h"

namespace flexel::lammps {
namespace {

// Each rank sums the forces on its own atoms, for LAMMPS has gathered those on ghosts before fixes act. Bonds
// are asked for once: all ranks have to ask together.
constexpr const char* kForces = R"(
library = ctypes.CDLL(None)
library.lammps_extract_atom.restype = library.lammps_extract_global.restype = ctypes.c_void_p
ctypes.pythonapi.PyCapsule_GetPointer.restype = ctypes.c_void_p
ctypes.pythonapi.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
bonds, seen, ends = None, np.zeros(0, np.int32), None

def array(lmp, name, count, kind, columns):
  if count == 0: return np.zeros((0, columns), kind)
  start = library.lammps_extract_atom(lmp, name)
  if columns > 1: start = ctypes.c_void_p.from_address(start).value
  return np.ctypeslib.as_array((kind * (columns * count)).from_address(start)).reshape(count, columns)

def all_bonds(lmp):
  if library.lammps_extract_setting(lmp, b"tagint") != 4:
    raise RuntimeError("[damping] needs LAMMPS with numbers of atoms of 32 bits, not one built with -DLAMMPS_BIGBIG")
  count = ctypes.c_int64.from_address(library.lammps_extract_global(lmp, b"nbonds")).value
  found = np.zeros((count, 3), np.int32)
  library.lammps_gather_bonds(lmp, found.ctypes.data_as(ctypes.c_void_p))
  return found

def find_ends(ids, own):
  place = np.full(max(bonds.max(), ids.max(initial=0)) + 1, -1)
  place[ids[::-1]] = np.arange(len(ids))[::-1]
  a, b = place[bonds[:, 1]], place[bonds[:, 2]]
  here = ((a >= 0) & (a < own)) | ((b >= 0) & (b < own))
  if (np.minimum(a, b)[here] < 0).any():
    raise RuntimeError("a bond leads beyond the ghosts: raise comm_modify cutoff")
  return a[here], b[here], damping[bonds[here, 0] - 1]

def forces(capsule):
  global bonds, seen, ends
  lmp = ctypes.c_void_p(ctypes.pythonapi.PyCapsule_GetPointer(capsule, None))
  own, every = library.lammps_extract_setting(lmp, b"nlocal"), library.lammps_extract_setting(lmp, b"nall")
  if bonds is None: bonds = all_bonds(lmp)
  ids = array(lmp, b"id", every, ctypes.c_int32, 1).ravel()
  if not np.array_equal(ids, seen): seen, ends = ids.copy(), find_ends(ids, own)
  a, b, resists = ends
  x, v = array(lmp, b"x", every, ctypes.c_double, 3), array(lmp, b"v", every, ctypes.c_double, 3)
  along, rate = x[b] - x[a], v[b] - v[a]
  pull = (resists * (along * rate).sum(axis=1) / (along * along).sum(axis=1))[:, None] * along
  each = [np.bincount(a, pull[:, c], every) - np.bincount(b, pull[:, c], every) for c in range(3)]
  return lmp, own, np.stack(each, axis=1)[:own]
)";

constexpr const char* kFunctions = R"(
def dashpots(capsule, virial):
  lmp, own, force = forces(capsule)
  array(lmp, b"f", own, ctypes.c_double, 3)[:] += force

def begin(capsule):
  lmp, own, force = forces(capsule)
  array(lmp, b"v", own, ctypes.c_double, 3)[:] += kick * force / array(lmp, b"rmass", own, ctypes.c_double, 1)
)";

}  // namespace

std::string dashpot_commands(const std::vector<double>& damping, double kick) {
  std::string text = "python begin input 1 SELF format p here \"\"\"\nimport ctypes\nimport numpy as np\n";
  append_text(text, "kick = {:.17g}\ndamping = np.array([", kick);
  for (std::size_t t = 0; t < damping.size(); ++t)
    append_text(text, "{}{:.17g}", t == 0 ? "" : t % 8 == 0 ? ",\n  " : ", ", damping[t]);
  text += "])\n";
  text += kForces;
  text += kFunctions;
  return text + "\"\"\"\npython dashpots exists\n";
}

}  // namespace flexel::lammps
