#!/usr/bin/env bash
# parry3d-f64 0.31.1's intersect_meshes of a cube of volume 8 with its copy slid by 0.3 along one axis, so that four sides are flush, is
# a mesh of volume 9.41, more than either cube; slid by 1 it is 6 where 4 is true. Slid along all three axes it is right. The same
# crate's contact tells depth 0 for the cubes that are 1 deep.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mkdir src
cat >Cargo.toml <<'END'
[package]
name = "flush"
version = "0.1.0"
edition = "2021"
[dependencies]
parry3d-f64 = "=0.31.1"
END
cat >src/main.rs <<'END'
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::shape::{Cuboid, TriMesh, TriMeshFlags};
use parry3d_f64::{query::contact, transformation::intersect_meshes};

fn volume(mesh: &TriMesh) -> f64 {
    mesh.triangles().map(|t| t.a.dot(t.b.cross(t.c)) / 6.0).sum()
}

fn main() {
    let (vertices, triangles) = Cuboid::new(Vector::new(1.0, 1.0, 1.0)).to_trimesh();
    let mut cube = TriMesh::new(vertices, triangles).unwrap();
    cube.set_flags(TriMeshFlags::all()).unwrap();
    let here = Pose::identity();
    let common = |x: f64, y: f64, z: f64| {
        let there = Pose::from_translation(Vector::new(x, y, z));
        let mesh = intersect_meshes(&here, &cube, false, &there, &cube, false).unwrap().unwrap();
        let depth = 0.0 - contact(&here, &cube, &there, &cube, 0.0).unwrap().unwrap().dist;
        let truth = (2.0 - x) * (2.0 - y) * (2.0 - z);
        println!("slid by {x} {y} {z}: volume {:.6} of {truth:.6}, depth {depth}", volume(&mesh));
        (volume(&mesh), depth)
    };
    assert!((common(0.3, 0.2, 0.1).0 - 5.814).abs() < 1e-9);
    assert!((common(0.3, 0.0, 0.0).0 - 9.406667).abs() < 1e-5);
    let (volume, depth) = common(1.0, 0.0, 0.0);
    assert!((volume - 6.0).abs() < 1e-9 && depth == 0.0);
}
END
cargo run --quiet --release
