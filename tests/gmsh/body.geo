// Made with Gmsh 4.15: gmsh -3 -order 2 -format msh41 body.geo -o text.msh; the same with -bin -o binary.msh
SetFactory("OpenCASCADE");
Cylinder(1) = {0, -12, -4, 0, 0, 8, 20};
Box(2) = {-10, 0, -4, 20, 20, 8};
BooleanIntersection(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Box(4) = {-5, 0, -4, 10, 3, 8};
BooleanFragments{ Volume{3}; Delete; }{ Volume{4}; Delete; }
core() = Volume In BoundingBox {-5.1, -0.1, -4.1, 5.1, 3.1, 4.1};
all() = Volume{:};
body() = all();
body() -= core();
base() = Surface In BoundingBox {-10.1, -0.1, -4.1, 10.1, 0.1, 4.1};
top() = Surface In BoundingBox {-10.1, 5.2, -4.1, 10.1, 8.1, 4.1};
Physical Surface("base") = base();
Physical Surface("Contact") = top();
Physical Volume("core") = core();
Physical Volume("body") = body();
Mesh.MeshSizeMax = 5;
Mesh.MeshSizeMin = 5;
