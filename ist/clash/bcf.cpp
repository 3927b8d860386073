#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "clash/report.h"
#include "library/text.h"
#include "mesh/import/xml_document.h"

namespace ist {
namespace {

/// FNV-1a from another start.
std::uint64_t hash(std::string_view text, std::uint64_t value) {
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return value;
}

/// A name-based UUID (version 8): the same for the same words.
std::string guid(const std::string& words) {
  const std::uint64_t high = hash(words, 0xcbf29ce484222325u), low = hash(words, ~high);
  return fmt::format("{:08x}-{:04x}-8{:03x}-{:04x}-{:012x}", high >> 32, high >> 16 & 0xffff,
                     high & 0xfff, (low >> 48 & 0x3fff) | 0x8000, low & 0xffffffffffff);
}

/// A zip archive whose files are stored as they are (APPNOTE 6.3, 4.3).
class Zip {
 public:
  void add(const std::string& name, const std::string& content) {
    const std::size_t at = bytes_.size();
    std::string common;
    number(common, 0x08000014, 4);  // version 2.0; names are UTF-8
    number(common, 0, 2);           // stored
    number(common, 0x210000, 4);    // 1980-01-01
    number(common, crc(content), 4);
    number(common, content.size(), 4);
    number(common, content.size(), 4);
    number(common, name.size(), 2);
    number(common, 0, 2);  // nothing extra
    number(bytes_, 0x04034b50, 4);
    bytes_ += common + name + content;
    number(directory_, 0x02014b50, 4);
    number(directory_, 20, 2);
    directory_ += common;
    number(directory_, 0, 2 + 2 + 2 + 4);  // no comment, disk 0, no attributes
    number(directory_, at, 4);
    directory_ += name;
    ++files_;
  }

  std::string finish() const {
    std::string end;
    number(end, 0x06054b50, 4);
    number(end, 0, 4);
    number(end, files_, 2);
    number(end, files_, 2);
    number(end, directory_.size(), 4);
    number(end, bytes_.size(), 4);
    number(end, 0, 2);
    return bytes_ + directory_ + end;
  }

 private:
  static void number(std::string& out, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out += static_cast<char>(i < 8 ? value >> (8 * i) & 0xff : 0);
  }

  static std::uint32_t crc(const std::string& content) {
    std::uint32_t sum = ~0u;
    for (const char c : content) {
      sum ^= static_cast<unsigned char>(c);
      for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ ((sum & 1) != 0 ? 0xedb88320u : 0);
    }
    return ~sum;
  }

  std::string bytes_, directory_;
  std::size_t files_ = 0;
};

/// An IFC's element, where its part is named after its 22 letters; else by the part's name.
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
                        short_vector(c.centroid), c.pose.empty() ? "" : ", pose ", xml_text(c.pose),
                        view));
    // From where all of a cube around the overlap is seen.
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
