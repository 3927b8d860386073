// An engine's run-time part: maps assets once and queries contacts in every step, without
// allocation or lock. Links ist::query alone.
#include <fcntl.h>
#include <ist/deadline.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>

/// The bytes of the file are the tree: no copy is made.
static ist::AssetView map_asset(const char* path) {
  const int file = open(path, O_RDONLY);
  struct stat info {};
  ist::AssetView tree;
  if (file < 0 || fstat(file, &info) != 0 || info.st_size == 0) {
    std::fprintf(stderr, "%s: cannot open\n", path);
    return tree;
  }
  const auto size = static_cast<std::size_t>(info.st_size);
  void* const memory = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  close(file);
  if (memory == MAP_FAILED) return tree;
  const ist::AssetStatus status =
      ist::AssetView::from_bytes({static_cast<const std::byte*>(memory), size}, tree);
  if (status != ist::AssetStatus::ok) std::fprintf(stderr, "%s: %s\n", path, describe(status));
  return tree;
}

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: engine A.ist B.ist\n"), 2;
  const ist::AssetView a = map_asset(argv[1]), b = map_asset(argv[2]);
  if (a.empty() || b.empty()) return 1;

  ist::Workspace scratch;  // one a thread
  ist::PenetrationSettings settings;
  ist::Deadline deadline(250);  // [µs] of a penetration; one per pair of bodies
  for (int step = 0; step < 10; ++step) {
    ist::PlacedAsset falling{b, {}};
    falling.pose.t[2] = 1.0 - 0.1 * step;
    deadline.limit(settings);
    const auto start = std::chrono::steady_clock::now();
    const ist::Penetration contact = ist::penetration({a, {}}, falling, settings, scratch);
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
    deadline.record(contact, took.count());
    // Its time is not the deadline's. Stopped, it says so, and its interval stays certified.
    ist::Separation gap;
    if (!(contact.volume > 0))
      gap = ist::separation({a, {}}, falling, {.max_visits = 2000}, scratch);
    std::printf("z %4.1f  volume %-10.4g gap %-8.4g force/k on B along z %.4g\n", falling.pose.t[2],
                contact.volume, gap.distance, contact.force.z());
  }
}
