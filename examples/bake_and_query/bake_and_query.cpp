// Two mesh files in, the volume by which they overlap out. Links ist::ist.
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>

#include <cstdio>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: bake_and_query MESH_A MESH_B\n"), 2;
  const ist::PackingSettings settings{.max_spheres = 2'000};
  const ist::Asset a = ist::bake(ist::close_mesh(ist::load_mesh(argv[1]), argv[1]), settings);
  const ist::Asset b = ist::bake(ist::close_mesh(ist::load_mesh(argv[2]), argv[2]), settings);
  const ist::Pose pose_b{.t = {0.5, 0, 0}};  // x_world = R x + t; A stays at the origin
  ist::Workspace scratch;
  const ist::Penetration p = ist::penetration({a.view(), {}}, {b.view(), pose_b}, {}, scratch);
  const Eigen::Vector3d push_on_b = p.force;  // times a pressure [force/u²]
  std::printf("overlap %g, push B along (%g, %g, %g)\n", p.volume, push_on_b.x(), push_on_b.y(),
              push_on_b.z());
} catch (const ist::Error& error) {  // names the file and the remedy; queries never throw
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
