#include <fmt/format.h>
#include <minizip/zip.h>
#include <algorithm>
#include <cmath>

#include "clash/clash.h"
#include "mesh/import/xml_document.h"

namespace ist {
namespace {

/// FNV-1a with another initial value.
std::uint64_t hash(std::string_view text, std::uint64_t value) {
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return value;
}

/// A name-based UUID (version 8): deterministic.
std::string guid(const std::string& words) {
  const std::uint64_t high = hash(words, 0xcbf29ce484222325u), low = hash(words, ~high);
  return fmt::format("{:08x}-{:04x}-8{:03x}-{:04x}-{:012x}", high >> 32, high >> 16 & 0xffff,
                     high & 0xfff, (low >> 48 & 0x3fff) | 0x8000, low & 0xffffffffffff);
}

/// A zip archive in memory. The same bytes for the same files.
class Zip {
 public:
  Zip() {
    zlib_filefunc64_def memory = {};
    memory.opaque = this;
    memory.zopen64_file = [](void* self, const void*, int) { return self; };
    memory.zwrite_file = [](void* self, void*, const void* bytes, uLong size) {
      Zip& zip = *static_cast<Zip*>(self);
      if (zip.bytes_.size() < zip.at_ + size) zip.bytes_.resize(zip.at_ + size);
      std::copy_n(static_cast<const char*>(bytes), size, zip.bytes_.data() + zip.at_);
      zip.at_ += size;
      return size;
    };
    memory.ztell64_file = [](void* self, void*) -> ZPOS64_T {
      return static_cast<Zip*>(self)->at_;
    };
    memory.zseek64_file = [](void* self, void*, ZPOS64_T to, int) -> long {  // always absolute
      static_cast<Zip*>(self)->at_ = to;
      return 0;
    };
    memory.zclose_file = memory.zerror_file = [](void*, void*) { return 0; };
    zip_ = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &memory);
  }
  void add(const std::string& name, const std::string& content) {
    zip_fileinfo info = {};
    info.dosDate = 0x210000;  // 1980-01-01
    zipOpenNewFileInZip(zip_, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED,
                        Z_DEFAULT_COMPRESSION);
    zipWriteInFileInZip(zip_, content.data(), static_cast<unsigned>(content.size()));
    zipCloseFileInZip(zip_);
  }
  std::string finish() {
    zipClose(zip_, nullptr);
    return std::move(bytes_);
  }

 private:
  zipFile zip_ = nullptr;
  std::string bytes_;
  std::size_t at_ = 0;
};

/// An IFC element, if its part is named by its 22 letters; else by the part's name.
std::string component(const std::string& name) {
  const bool ifc =
      name.size() == 22 &&
      name.find_first_not_of("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$") ==
          std::string::npos;
  return fmt::format(
      "<Component{}><OriginatingSystem>ist</OriginatingSystem><AuthoringToolId>{}"
      "</AuthoringToolId></Component>",
      ifc ? fmt::format(" IfcGuid=\"{}\"", name) : "", xml_text(name));
}

std::string vector(const char* element, const Eigen::Vector3d& v) {
  return fmt::format("<{0}><X>{1:.17g}</X><Y>{2:.17g}</Y><Z>{3:.17g}</Z></{0}>", element, v.x(),
                     v.y(), v.z());
}

constexpr const char* kXml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

}  // namespace

std::string clashes_bcf(const ClashReport& report, const std::string& date) {
  Zip zip;
  zip.add("bcf.version", std::string(kXml) +
                             "<Version VersionId=\"2.1\"><DetailedVersion>2.1</DetailedVersion>"
                             "</Version>\n");
  for (const Clash& c : report.pairs) {
    if (!report.is_clash(c)) continue;
    const auto [a, b] = report.names_of(c);
    const std::string topic = guid(a + '\0' + b), view = guid(a + '\0' + b + "/view");
    zip.add(topic + "/markup.bcf",
            fmt::format("{}<Markup><Topic Guid=\"{}\" TopicType=\"Clash\" TopicStatus=\"Open\">"
                        "<Title>{} overlaps {}</Title><CreationDate>{}</CreationDate>"
                        "<CreationAuthor>ist</CreationAuthor><Description>volume {:.6g}, depth "
                        "{:.6g}, at {}{}{}</Description></Topic><Viewpoints Guid=\"{}\">"
                        "<Viewpoint>viewpoint.bcfv</Viewpoint></Viewpoints></Markup>\n",
                        kXml, topic, xml_text(a), xml_text(b), date, c.volume, c.depth,
                        place_text(c.centroid), c.pose.empty() ? "" : ", pose ", xml_text(c.pose),
                        view));
    // A distance from which a cube around the overlap is visible.
    const double away = 8 * std::max(std::cbrt(c.volume_max), c.depth);
    const Eigen::Vector3d look = Eigen::Vector3d(-1, 1, -1).normalized();
    zip.add(topic + "/viewpoint.bcfv",
            fmt::format("{}<VisualizationInfo Guid=\"{}\"><Components><Selection>{}{}</Selection>"
                        "<Visibility DefaultVisibility=\"true\"/></Components><PerspectiveCamera>"
                        "{}{}{}<FieldOfView>60</FieldOfView></PerspectiveCamera>"
                        "</VisualizationInfo>\n",
                        kXml, view, component(a), component(b),
                        vector("CameraViewPoint", c.centroid - away * look),
                        vector("CameraDirection", look),
                        vector("CameraUpVector", Eigen::Vector3d(-1, 1, 2).normalized())));
  }
  return zip.finish();
}

}  // namespace ist
