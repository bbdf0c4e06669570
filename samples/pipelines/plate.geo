// A plate of 60 x 20 x 4 mm with a round hole.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 60, 20, 4};
Cylinder(2) = {30, 10, -1, 0, 0, 6, 6};
BooleanDifference{ Volume{1}; Delete; }{ Volume{2}; Delete; }
Mesh.MeshSizeMax = 2;
