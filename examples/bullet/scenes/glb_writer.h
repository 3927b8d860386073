#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

class SceneWorld;

/// An animated scene as binary glTF 2.0: a mesh a part, a node a body with its way in time. z is up
/// in the scenes and y in glTF, so one node above all turns it.
///
/// Bullet's boxes are drawn, planes and terrains are not.
class GlbWriter {
 public:
  explicit GlbWriter(const SceneWorld& world);

  /// Keeps where the bodies are, 60 times a second of the scene.
  void record(const SceneWorld& world);

  /// Throws std::runtime_error.
  void write(const std::filesystem::path& path) const;

 private:
  struct Track {
    std::vector<float> translations, rotations;  // 3 and 4 numbers a frame
  };
  struct Mesh {
    std::string name;
    std::vector<float> positions;  // 3 numbers a corner, of triangles that share none
    std::vector<float> normals;
  };
  struct Node {
    std::size_t mesh;
    bool still;
    Track track;
  };

  double next_ = 0;  // [s]
  std::vector<float> times_;
  std::vector<Mesh> meshes_;
  std::vector<Node> nodes_;
  std::vector<std::size_t> body_of_node_;
};
