"""The reference of tests/simulate/beam_test.cpp: the paper's cantilever by CalculiX (Debian's calculix-ccx 2.20).

C3D20R, n elements through 0.5 m, clamped at x = 0, uniform traction over the end x = 2 m. Prints the mean displacement of the end
along the load per newton, for n = 2, 4, 8, and its Richardson extrapolation (order from the three); then the two lowest
frequencies of the beam (density 580 kg/m3), the reference of tests/simulate/motion_test.cpp.
Run: python3 tests/simulate/reference/beam_ccx.py
"""
import os
import subprocess
import tempfile


def run(folder, n, nu, axis, elem="C3D20R", frequencies=False):
    L,W,H=2.0,0.7,0.5; E=12.1e5; F=1e-3
    nx,ny,nz=4*n,max(1,round(1.4*n)),n
    hx,hy,hz=L/nx,W/ny,H/nz
    ids={}; nodes=[]
    def node(i,j,k):
        key=(i,j,k)
        if key not in ids:
            ids[key]=len(ids)+1; nodes.append((i*hx/2,j*hy/2,k*hz/2))
        return ids[key]
    el=[]
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                c=lambda a,b,d: node(2*i+a,2*j+b,2*k+d)
                el.append([c(0,0,0),c(2,0,0),c(2,2,0),c(0,2,0),c(0,0,2),c(2,0,2),c(2,2,2),c(0,2,2),
                  c(1,0,0),c(2,1,0),c(1,2,0),c(0,1,0),c(1,0,2),c(2,1,2),c(1,2,2),c(0,1,2),
                  c(0,0,1),c(2,0,1),c(2,2,1),c(0,2,1)])
    fixed=[v for (i,j,k),v in ids.items() if i==0]
    # consistent nodal loads on the end faces: 8-node serendipity: corners -1/12, mids 1/3 of the face's force
    f={}
    ff=F/(ny*nz)
    for k in range(nz):
        for j in range(ny):
            for (b,d) in ((0,0),(2,0),(0,2),(2,2)):
                v=node(2*nx,2*j+b,2*k+d); f[v]=f.get(v,0)-ff/12
            for (b,d) in ((1,0),(2,1),(1,2),(0,1)):
                v=node(2*nx,2*j+b,2*k+d); f[v]=f.get(v,0)+ff/3
    name=os.path.join(folder, f"beam_{n}")
    with open(name+".inp","w") as o:
        o.write("*NODE, NSET=ALL\n")
        for q,p in enumerate(nodes): o.write(f"{q+1},{p[0]:.12g},{p[1]:.12g},{p[2]:.12g}\n")
        o.write(f"*ELEMENT, TYPE={elem}, ELSET=E\n")
        for q,e in enumerate(el):
            t=[q+1]+e; o.write(",".join(map(str,t[:15]))+",\n"+",".join(map(str,t[15:]))+"\n")
        o.write("*NSET, NSET=FIX\n"+",\n".join(map(str,fixed))+"\n")
        o.write("*NSET, NSET=END\n"+",\n".join(str(v) for v in f)+"\n")
        o.write(f"*MATERIAL,NAME=M\n*ELASTIC\n{E},{nu}\n*DENSITY\n580\n*SOLID SECTION,ELSET=E,MATERIAL=M\n*BOUNDARY\nFIX,1,3\n*STEP\n")
        if frequencies:
            o.write("*FREQUENCY\n2\n*END STEP\n")
        else:
            o.write("*STATIC\n*CLOAD\n")
            for v,x in f.items(): o.write(f"{v},{axis+1},{x:.12g}\n")
            o.write("*NODE PRINT, NSET=END\nU\n*END STEP\n")
    subprocess.run(["ccx",name],stdout=subprocess.DEVNULL,check=True)
    if frequencies:  # "mode  eigenvalue  rad/s  Hz  imaginary part"
        rows=[line.split() for line in open(name+".dat")]
        return [float(row[3]) for row in rows if len(row)==5 and row[0] in ("1","2")][:2]
    u={}
    for line in open(name+".dat"):
        t=line.split()
        if len(t)==4 and t[0].isdigit(): u[int(t[0])]=[float(x) for x in t[1:]]
    # mean over the end by the same consistent weights (work conjugate) -> F.u/F
    mean=sum(f[v]*u[v][axis] for v in f)/F
    return mean/F
with tempfile.TemporaryDirectory() as folder:
    for nu in (0.25, 0.3):
        for axis in (1, 2):
            a, b, c = (run(folder, n, nu, axis) for n in (2, 4, 8))
            limit = c + (c - b) ** 2 / ((b - a) - (c - b))
            print(f"nu {nu} axis {'xyz'[axis]}: n = 2, 4, 8: {a:.6e} {b:.6e} {c:.6e}; extrapolated {limit:.5e} m/N", flush=True)
    for nu in (0.25, 0.3):
        a, b = (run(folder, n, nu, 0, frequencies=True) for n in (4, 8))
        print(f"nu {nu} frequencies n = 4: {a[0]:.6g} {a[1]:.6g} Hz, n = 8: {b[0]:.6g} {b[1]:.6g} Hz", flush=True)
