#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include <ist/bullet/contacts.h>

namespace ist::bullet {

namespace {

void print(const char* sentence) { std::fprintf(stderr, "ist::bullet: %s\n", sentence); }

struct Warnings {
  std::mutex mutex;
  WarningHandler handler = print;
  std::set<std::pair<const Contacts*, std::string>> given;
};
Warnings& warnings() {
  static Warnings all;
  return all;
}

}  // namespace

WarningHandler set_warning_handler(WarningHandler handler) {
  const std::lock_guard lock(warnings().mutex);
  const WarningHandler before = warnings().handler;
  warnings().handler = handler != nullptr ? handler : print;
  return before;
}

void warn(const char* sentence, const Contacts* world) {
  WarningHandler handler = nullptr;
  {
    const std::lock_guard lock(warnings().mutex);
    if (!warnings().given.emplace(world, sentence).second) return;
    handler = warnings().handler;
  }
  handler(sentence);
}

Contacts::~Contacts() {
  const std::lock_guard lock(warnings().mutex);
  std::erase_if(warnings().given, [this](const auto& one) { return one.first == this; });
}

}  // namespace ist::bullet
