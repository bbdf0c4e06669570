"""gmsh's quadratic tetrahedra of a part, for calculix.py: the mesh, the triangles of a face of it, areas and weights. mm."""

import math
import os
import re
import subprocess

import numpy as np

TOLERANCE = 1e-6  # mm, a node lies on a face


def measured(command, **options):
    """Processor seconds and MB of a process."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, **options)
    text = process.stderr.read().decode(errors="replace")
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: {text[-400:]}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000


# Faces: a function of the mesh that tells its triangles.


def plane(axis, value):
    return lambda mesh: (np.abs(mesh.corners[:, :, axis] - value) < TOLERANCE).all(axis=1)


def cylinder(radius):
    return lambda mesh: (np.abs(np.hypot(mesh.corners[:, :, 0], mesh.corners[:, :, 1]) - radius) < 1e-3).all(axis=1)


def cad_face(face):
    """A flat face of `flexel info`: gmsh's surface with its middle and area."""
    middle, side = 1e3 * np.array(face["centroid"]), 1e3 * math.sqrt(face["area"])

    def triangles(mesh):
        areas = np.linalg.norm(mesh.areas(mesh.triangles), axis=1)
        area = np.bincount(mesh.surface, areas)
        centre = mesh.corners[:, :3].mean(axis=1)
        off = abs(np.sqrt(area) - side)
        for axis in range(3):
            off = off + abs(np.bincount(mesh.surface, areas * centre[:, axis]) / np.maximum(area, TOLERANCE**2) - middle[axis])
        if min(off) > 0.1 * side:  # a coarse mesh cuts round edges short
            raise RuntimeError(f"gmsh has no surface that is {face['selection']}")
        return mesh.surface == np.argmin(off)

    return triangles


def read_mesh(path):
    """Nodes by number, tetrahedra of ten, triangles of six and the number of each triangle's surface, from gmsh's .inp."""
    nodes, solids, faces, surfaces = {}, [], [], []
    into, surface = None, 0
    for line in path.read_text().splitlines():
        if line.startswith("*"):
            upper = line.upper()
            into = "node" if upper.startswith("*NODE") else "C3D10" if "C3D10" in upper else "CPS6" if "CPS6" in upper else None
            if into == "CPS6":
                surface = int(re.search(r"ELSET=SURFACE(\d+)", upper)[1])
            rest = []
            continue
        values = line.replace(",", " ").split()
        if into == "node":
            nodes[int(values[0])] = [float(value) for value in values[1:4]]
        elif into:
            rest += [int(value) for value in values]
            want = 11 if into == "C3D10" else 7
            if len(rest) >= want:
                (solids if into == "C3D10" else faces).append(rest[1:want])
                if into == "CPS6":
                    surfaces.append(surface)
                rest = []
    return nodes, solids, faces, surfaces


EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # of C3D10's nodes 5 to 10


def shape_derivatives(at):
    """(10, 3) of C3D10 by the local coordinates."""
    gradient = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    l = np.array([1 - sum(at), *at])
    corners = [(4 * l[i] - 1) * gradient[i] for i in range(4)]
    return np.array(corners + [4 * (l[i] * gradient[j] + l[j] * gradient[i]) for i, j in EDGES])


def straighten_folded(points, solids):
    """Curved edges turn coarse tetrahedra inside out at small fillets; those get straight ones, in place."""
    near, far = (5 - math.sqrt(5)) / 20, (5 + 3 * math.sqrt(5)) / 20
    places = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [near] * 3, *([far if i == j else near for i in range(3)] for j in range(3))]
    derivatives = np.array([shape_derivatives(at) for at in places])
    left = solids
    while len(left):
        at = points[left]
        straight = np.linalg.det(at[:, 1:4] - at[:, :1])
        jacobians = np.linalg.det(np.einsum("enx,pni->epxi", at, derivatives))
        folded = left[(straight > 0) & (jacobians.min(axis=1) < 0.05 * straight)]
        for k, (i, j) in enumerate(EDGES):
            points[folded[:, 4 + k]] = (points[folded[:, i]] + points[folded[:, j]]) / 2
        left = solids[np.isin(solids, folded[:, 4:]).any(axis=1)]


class Mesh:
    def __init__(self, case, folder, size):
        geo = folder / "part.geo"
        turn = ""
        if case.angles:
            x, z = case.angles
            turn = (f"Rotate {{ {{1, 0, 0}}, {{0, 0, 0}}, {x} * Pi / 180 }} {{ Volume{{:}}; }}\n"
                    f"Rotate {{ {{0, 0, 1}}, {{0, 0, 0}}, {z} * Pi / 180 }} {{ Volume{{:}}; }}\n")
        geo.write_text(f'SetFactory("OpenCASCADE");\n{case.geometry}\n{turn}Mesh.SaveAll = 1; Mesh.CharacteristicLengthMax = {size};\n'
                       f"Mesh.ElementOrder = 2; Mesh.HighOrderOptimize = {0 if case.step else 1};\n")
        self.seconds, _ = measured(["gmsh", geo, "-3", "-format", "inp", "-o", folder / "mesh.inp", "-v", "1"])
        found, self.solids, triangles, surfaces = read_mesh(folder / "mesh.inp")
        used = sorted({node for solid in self.solids for node in solid})
        self.place = {node: i for i, node in enumerate(used)}
        self.points = np.array([found[node] for node in used])
        straighten_folded(self.points, np.array([[self.place[node] for node in solid] for solid in self.solids]))
        self.rest = self.points @ case.turn  # turned back
        self.triangles = np.array([[self.place[node] for node in triangle] for triangle in triangles])
        self.corners = self.rest[self.triangles]  # (triangles, 6, 3) mm
        self.surface = np.array(surfaces)

    def triangles_on(self, face):
        return self.triangles[face(self)]

    def areas(self, triangles):
        """Area vectors, outward."""
        a, b, c = (self.rest[triangles[:, i]] for i in range(3))
        area = 0.5 * np.cross(b - a, c - a)
        return area

    def weights(self, triangles):
        """Of the mean over a face: a third of each triangle's area at its middle nodes."""
        weights = np.zeros(len(self.points))
        area = np.linalg.norm(self.areas(triangles), axis=1)
        for i in range(3, 6):
            np.add.at(weights, triangles[:, i], area / 3)
        return weights
