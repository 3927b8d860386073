#include "glb_writer.h"

#include <ist/bullet/convert.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

#include "meshes.h"
#include "world.h"

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

using ist::bullet::to_bullet;
using ist::bullet::to_eigen;

namespace {

/// Corners of all triangles with the normals of their faces: edges are to be seen as edges.
void unfold(const std::vector<Eigen::Vector3d>& vertices, const ist::TriangleMesh& mesh,
            std::vector<float>& positions, std::vector<float>& normals) {
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    const Eigen::Vector3d n = (b - a).cross(c - a).normalized();
    for (const Eigen::Vector3d* v : {&a, &b, &c}) {
      for (int k = 0; k < 3; ++k) {
        positions.push_back(static_cast<float>((*v)[k]));
        normals.push_back(static_cast<float>(n[k]));
      }
    }
  }
}

/// The binary part, and the JSON of its views and accessors.
class Buffer {
 public:
  /// Index of the accessor.
  std::size_t add(const std::vector<float>& data, int width, bool bounds) {
    static constexpr const char* kTypes[] = {"", "SCALAR", "", "VEC3", "VEC4"};
    const std::size_t bytes = data.size() * sizeof(float);
    const std::size_t count = data.size() / static_cast<std::size_t>(width);
    views_ << (count_ > 0 ? "," : "") << "{\"buffer\":0,\"byteOffset\":" << bytes_.size()
           << ",\"byteLength\":" << bytes << "}";
    accessors_ << (count_ > 0 ? "," : "") << "{\"bufferView\":" << count_
               << ",\"componentType\":5126,\"count\":" << count << ",\"type\":\"" << kTypes[width]
               << "\"";
    if (bounds) {
      for (const bool low : {true, false}) {
        accessors_ << (low ? ",\"min\":[" : ",\"max\":[");
        for (int k = 0; k < width; ++k) {
          float best = data[static_cast<std::size_t>(k)];
          for (std::size_t i = static_cast<std::size_t>(k); i < data.size();
               i += static_cast<std::size_t>(width)) {
            best = low ? std::min(best, data[i]) : std::max(best, data[i]);
          }
          accessors_ << (k > 0 ? "," : "") << best;
        }
        accessors_ << "]";
      }
    }
    accessors_ << "}";
    const std::size_t at = bytes_.size();
    bytes_.resize(at + bytes);
    if (bytes > 0) std::memcpy(bytes_.data() + at, data.data(), bytes);
    return count_++;
  }

  std::string json() const {
    return "\"buffers\":[{\"byteLength\":" + std::to_string(bytes_.size()) +
           "}],\"bufferViews\":[" + views_.str() + "],\"accessors\":[" + accessors_.str() + "]";
  }
  const std::vector<char>& bytes() const { return bytes_; }

  Buffer() {
    for (std::ostringstream* s : {&views_, &accessors_}) {
      s->imbue(std::locale::classic());
      s->precision(9);
    }
  }

 private:
  std::vector<char> bytes_;
  std::ostringstream views_, accessors_;
  std::size_t count_ = 0;
};

}  // namespace

GlbWriter::GlbWriter(const SceneWorld& world) {
  std::map<const Part*, std::size_t> known;
  for (std::size_t i = 0; i < world.bodies().size(); ++i) {
    const SceneWorld::Body& body = world.bodies()[i];
    std::size_t mesh = meshes_.size();
    if (body.part != nullptr) {
      const auto [it, fresh] = known.try_emplace(body.part, mesh);
      mesh = it->second;
      if (fresh) {
        Mesh& m = meshes_.emplace_back();
        m.name = body.part->name();
        unfold(body.part->vertices_in_body(), body.part->mesh(), m.positions, m.normals);
      }
    } else if (body.own_shape->getShapeType() == BOX_SHAPE_PROXYTYPE) {
      const ist::TriangleMesh box = make_box(
          to_eigen(static_cast<const btBoxShape&>(*body.own_shape).getHalfExtentsWithMargin()));
      Mesh& m = meshes_.emplace_back();
      m.name = "box";
      unfold(box.vertices, box, m.positions, m.normals);
    } else {
      continue;
    }
    nodes_.push_back({mesh, body.rigid->getInvMass() == 0, {}});
    body_of_node_.push_back(i);
  }
}

void GlbWriter::record(const SceneWorld& world) {
  if (world.time() < next_ - 1e-9) return;
  next_ += 1.0 / 60;
  times_.push_back(static_cast<float>(world.time()));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const btTransform& at = world.bodies()[body_of_node_[i]].rigid->getWorldTransform();
    const btQuaternion q = at.getRotation();
    Track& track = nodes_[i].track;
    for (int k = 0; k < 3; ++k) {
      track.translations.push_back(static_cast<float>(at.getOrigin()[k]));
    }
    for (const double x : {q.x(), q.y(), q.z(), q.w()}) {
      track.rotations.push_back(static_cast<float>(x));
    }
  }
}

void GlbWriter::write(const std::filesystem::path& path) const {
  Buffer buffer;
  std::ostringstream meshes, nodes, samplers, channels, children;
  for (std::ostringstream* s : {&meshes, &nodes, &samplers, &channels, &children}) {
    s->imbue(std::locale::classic());
    s->precision(9);
  }
  const std::size_t times = buffer.add(times_, 1, true);
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    const std::size_t positions = buffer.add(meshes_[i].positions, 3, true);
    const std::size_t normals = buffer.add(meshes_[i].normals, 3, false);
    meshes << (i > 0 ? "," : "") << "{\"name\":\"" << meshes_[i].name
           << "\",\"primitives\":[{\"attributes\":{\"POSITION\":" << positions
           << ",\"NORMAL\":" << normals << "}}]}";
  }
  std::size_t sampler = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Track& track = nodes_[i].track;
    const auto first = [&](const std::vector<float>& v, std::size_t width) {
      std::ostringstream s;
      s.imbue(std::locale::classic());
      s.precision(9);
      for (std::size_t k = 0; k < width; ++k) s << (k > 0 ? "," : "") << v[k];
      return s.str();
    };
    nodes << ",{\"mesh\":" << nodes_[i].mesh << ",\"translation\":[" << first(track.translations, 3)
          << "],\"rotation\":[" << first(track.rotations, 4) << "]}";
    children << (i > 0 ? "," : "") << i + 1;
    if (nodes_[i].still) continue;
    const std::size_t translations = buffer.add(track.translations, 3, false);
    const std::size_t rotations = buffer.add(track.rotations, 4, false);
    for (const auto& [output, path_name] :
         {std::pair{translations, "translation"}, std::pair{rotations, "rotation"}}) {
      samplers << (sampler > 0 ? "," : "") << "{\"input\":" << times << ",\"output\":" << output
               << ",\"interpolation\":\"LINEAR\"}";
      channels << (sampler > 0 ? "," : "") << "{\"sampler\":" << sampler
               << ",\"target\":{\"node\":" << i + 1 << ",\"path\":\"" << path_name << "\"}}";
      ++sampler;
    }
  }
  const double half = std::sqrt(0.5);
  std::ostringstream json;
  json.imbue(std::locale::classic());
  json.precision(9);
  json << "{\"asset\":{\"version\":\"2.0\",\"generator\":\"ist bullet_scenes\"},\"scene\":0,"
       << "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"rotation\":[" << -half << ",0,0," << half
       << "],\"children\":[" << children.str() << "]}" << nodes.str() << "],\"meshes\":["
       << meshes.str() << "]";
  if (sampler > 0) {
    json << ",\"animations\":[{\"samplers\":[" << samplers.str() << "],\"channels\":["
         << channels.str() << "]}]";
  }
  json << "," << buffer.json() << "}";

  std::string text = json.str();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::vector<char> bytes = buffer.bytes();
  bytes.resize((bytes.size() + 3) / 4 * 4, 0);
  std::ofstream file(path, std::ios::binary);
  const auto word = [&](std::size_t value) {
    const auto w = static_cast<std::uint32_t>(value);
    file.write(reinterpret_cast<const char*>(&w), 4);
  };
  file.write("glTF", 4);
  word(2);
  word(12 + 8 + text.size() + 8 + bytes.size());
  word(text.size());
  file.write("JSON", 4);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  word(bytes.size());
  file.write("BIN\0", 4);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot write");
}
