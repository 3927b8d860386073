// A haptic loop: 1000 times a second, a probe that is dragged over an object is asked for its
// contact, and how late the answers come is kept. Links ist::query alone.
#include <fcntl.h>
#include <ist/query.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <thread>
#include <vector>

namespace {

using Eigen::Vector3d;

const char* const kUsage =
    "usage: haptic_loop OBJECT.ist PROBE.ist [--scale S]   of the probe (1)\n"
    "                   [--seconds T] [--rate HZ]          how long (60), how often (1000)\n"
    "                   [--deadline-us D]                  cut queries short (0: never)\n"
    "                   [--load N]                         threads that burden the machine (0)\n"
    "                   [--fifo]                           real-time priority, if permitted\n"
    "                   [--json FILE]\n";

struct Options {
  const char* object = nullptr;
  const char* probe = nullptr;
  const char* json = nullptr;
  double scale = 1, seconds = 60, rate = 1000, deadline_us = 0;
  int load = 0;
  bool fifo = false;
};

Options parse(int argc, char** argv) {
  Options options;
  const char** files[] = {&options.object, &options.probe};
  int file = 0;
  for (int i = 1; i < argc; ++i) {
    const auto number = [&] { return i + 1 < argc ? std::atof(argv[++i]) : 0.0; };
    if (std::strcmp(argv[i], "--scale") == 0)
      options.scale = number();
    else if (std::strcmp(argv[i], "--seconds") == 0)
      options.seconds = number();
    else if (std::strcmp(argv[i], "--rate") == 0)
      options.rate = number();
    else if (std::strcmp(argv[i], "--deadline-us") == 0)
      options.deadline_us = number();
    else if (std::strcmp(argv[i], "--load") == 0)
      options.load = static_cast<int>(number());
    else if (std::strcmp(argv[i], "--fifo") == 0)
      options.fifo = true;
    else if (std::strcmp(argv[i], "--json") == 0 && i + 1 < argc)
      options.json = argv[++i];
    else if (argv[i][0] != '-' && file < 2)
      *files[file++] = argv[i];
    else
      file = 3;
  }
  if (file != 2 || !(options.scale > 0) || !(options.seconds > 0) || !(options.rate > 0)) {
    std::fputs(kUsage, stderr);
    std::exit(2);
  }
  return options;
}

ist::TreeView map_asset(const char* path) {
  const int file = open(path, O_RDONLY);
  struct stat info {};
  ist::TreeView tree;
  if (file < 0 || fstat(file, &info) != 0 || info.st_size == 0) {
    std::fprintf(stderr, "%s: cannot open\n", path);
    std::exit(1);
  }
  const auto size = static_cast<std::size_t>(info.st_size);
  // Read in whole now: a page fault inside the loop would be a disk access.
  void* const memory = mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, file, 0);
  close(file);
  const ist::AssetStatus status =
      memory == MAP_FAILED
          ? ist::AssetStatus::too_short
          : ist::TreeView::from_bytes({static_cast<const std::byte*>(memory), size}, tree);
  if (status != ist::AssetStatus::ok) {
    std::fprintf(stderr, "%s: %s\n", path, describe(status));
    std::exit(1);
  }
  return tree;
}

/// A hand that strokes the object with the probe: it goes round over the surface, presses more and
/// less, and now and then lifts off. All it knows is the last answer.
class Hand {
 public:
  Hand(double object_volume, double probe_volume)
      : speed_(0.3 * std::cbrt(object_volume)), press_(0.02 * std::cbrt(probe_volume)) {
    place_ = 10 * std::cbrt(object_volume) * Vector3d(1, 0.2, 0.1).normalized();
  }

  ist::Pose pose() const {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7 * time_, Vector3d(0.6, 0, 0.8)));
    return {{turn.w(), turn.x(), turn.y(), turn.z()}, {place_.x(), place_.y(), place_.z()}};
  }

  void move(const ist::PenetrationAndSeparation& contact, double seconds) {
    time_ += seconds;
    const ist::Penetration& p = contact.penetration;
    const double area = p.translation_gradient.norm();
    const double depth = p.volume > 0 && area > 0 ? p.volume / area : -contact.separation.distance;
    if (p.volume > 0 && area > 0) {
      out_ = -p.translation_gradient / area;
    } else if (contact.separation.distance > 0) {
      out_ = contact.separation.normal;
    }
    const double wanted = press_ * (1 + 1.5 * std::sin(5 * time_));
    // No faster than a hand, but for the way to the object at the start.
    const double step = depth < -5 * press_ ? -depth : 5 * speed_ * seconds;
    place_ += std::clamp(depth - wanted, -step, step) * out_;
    const Vector3d round =
        Vector3d(std::sin(0.37 * time_), std::cos(0.23 * time_), 0.5).normalized();
    place_ += speed_ * seconds * round.cross(out_);
  }

 private:
  double speed_;  ///< [u/s]
  double press_;  ///< [u] depth
  double time_ = 0;
  Vector3d place_;
  Vector3d out_ = Vector3d::UnitX();
};

/// Computes and walks through more memory than caches hold, until told to stop.
void burden(const std::atomic<bool>& stop) {
  std::vector<std::uint32_t> memory(1 << 24);
  std::uint32_t at = 1;
  while (!stop.load(std::memory_order_relaxed))
    for (int i = 0; i < 4096; ++i) {
      at = at * 1664525 + 1013904223;
      memory[at >> 8] += at;
    }
}

double clock_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}
double now_us() { return clock_us(CLOCK_MONOTONIC); }

void sleep_until(double us) {
  timespec t{};
  t.tv_sec = static_cast<time_t>(us / 1e6);
  t.tv_nsec = static_cast<long>(1e3 * (us - 1e6 * static_cast<double>(t.tv_sec)));
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

/// Answers that came after the next tick was due, by what is to blame.
struct Missed {
  std::size_t query = 0;        ///< the query itself ran for longer than a period
  std::size_t timer = 0;        ///< the loop was woken late; the query then took less than a period
  std::size_t interrupted = 0;  ///< in time by its own work, but something else ran in its midst

  std::size_t all() const { return query + timer + interrupted; }

  /// `computed`: time this thread ran for the answer; `taken`: wall time from call to answer.
  void count(double computed, double taken, double period) {
    ++(computed > period ? query : taken > period ? interrupted : timer);
  }
};

struct Quantiles {
  double p50, p99, p999, max;
};

Quantiles quantiles(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double p) {
    return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1) + 0.5)];
  };
  return {at(0.5), at(0.99), at(0.999), values.back()};
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const ist::TreeView object = map_asset(options.object), probe = map_asset(options.probe);
  ist::Workspace scratch;
  ist::QuerySettings settings;
  settings.penetration.deadline_us = settings.separation.deadline_us = options.deadline_us;
  Hand hand(object.volume(), probe.volume() * std::pow(options.scale, 3));
  const double period = 1e6 / options.rate;  // [µs]
  const auto ticks = static_cast<std::size_t>(std::ceil(options.seconds * options.rate));
  std::vector<double> overslept, computed, taken, late;  // [µs] one a tick
  for (std::vector<double>* const times : {&overslept, &computed, &taken, &late})
    times->reserve(ticks);

  std::atomic<bool> stop = false;
  std::vector<std::thread> burdens;
  for (int i = 0; i < options.load; ++i) burdens.emplace_back(burden, std::cref(stop));
  bool fifo = false;
  if (options.fifo) {
    const sched_param priority{80};
    fifo = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) == 0;
    if (!fifo) std::fputs("haptic_loop: no permission for real-time priority\n", stderr);
    mlockall(MCL_CURRENT);
  }

  // Until it touches: the first answers also bring memory and caches up.
  for (int i = 0; i < 100; ++i)
    hand.move(query({object, {}}, {probe, hand.pose(), options.scale}, settings, scratch), 1e-3);

  Missed missed;
  std::size_t skipped = 0, touching = 0, cut_short = 0;
  double due = now_us() + period;
  for (std::size_t i = 0; i < ticks; ++i) {
    sleep_until(due);
    const double woken = now_us();
    const double ran = clock_us(CLOCK_THREAD_CPUTIME_ID);
    const ist::PenetrationAndSeparation contact =
        query({object, {}}, {probe, hand.pose(), options.scale}, settings, scratch);
    computed.push_back(clock_us(CLOCK_THREAD_CPUTIME_ID) - ran);
    const double done = now_us();
    overslept.push_back(woken - due);
    taken.push_back(done - woken);
    late.push_back(done - due);
    if (contact.penetration.volume > 0) ++touching;
    if (contact.penetration.status != ist::QueryStatus::ok) ++cut_short;
    hand.move(contact, 1e-6 * period);  // a device would be sent pressure · −translation_gradient
    due += period;
    if (done > due) {  // the next tick was due before this one was answered
      missed.count(computed.back(), taken.back(), period);
      const double behind = std::floor((done - due) / period);
      skipped += static_cast<std::size_t>(behind);
      due += behind * period;
    }
  }
  stop = true;
  for (std::thread& thread : burdens) thread.join();

  const struct {
    const char *name, *key, *text;
    Quantiles us;
  } rows[] = {
      {"timer", "overslept_us", "from the tick to being woken", quantiles(overslept)},
      {"query", "computed_us", "this thread's time for the answer", quantiles(computed)},
      {"wall", "query_us", "from call to answer", quantiles(taken)},
      {"late", "late_us", "from the tick to the answer", quantiles(late)},
  };
  std::printf("%zu ticks at %g Hz, %zu in contact, %d load threads%s\n", ticks, options.rate,
              touching, options.load, fifo ? ", real-time priority" : "");
  std::printf("[us]      p50      p99    p99.9      max\n");
  for (const auto& row : rows)
    std::printf("%-5s %7.1f  %7.1f  %7.1f  %7.1f   %s\n", row.name, row.us.p50, row.us.p99,
                row.us.p999, row.us.max, row.text);
  std::printf(
      "missed deadlines: %zu, of them %zu by the query, %zu by an overslept timer, %zu "
      "interrupted;\n"
      "ticks skipped after them: %zu, answers cut short: %zu\n",
      missed.all(), missed.query, missed.timer, missed.interrupted, skipped, cut_short);
  if (options.json == nullptr) return 0;
  std::FILE* const file = std::fopen(options.json, "w");
  if (file == nullptr) return std::fprintf(stderr, "%s: cannot write\n", options.json), 1;
  std::fprintf(file,
               "{\"ticks\": %zu, \"rate_hz\": %g, \"load_threads\": %d, \"fifo\": %s,\n"
               " \"object_spheres\": %zu, \"probe_spheres\": %zu, \"in_contact\": %zu,\n"
               " \"missed\": %zu, \"missed_by_query\": %zu, \"missed_by_timer\": %zu,\n"
               " \"interrupted\": %zu, \"skipped\": %zu, \"cut_short\": %zu",
               ticks, options.rate, options.load, fifo ? "true" : "false", object.sphere_count(),
               probe.sphere_count(), touching, missed.all(), missed.query, missed.timer,
               missed.interrupted, skipped, cut_short);
  for (const auto& row : rows)
    std::fprintf(file, ",\n \"%s\": {\"p50\": %.3f, \"p99\": %.3f, \"p99.9\": %.3f, \"max\": %.3f}",
                 row.key, row.us.p50, row.us.p99, row.us.p999, row.us.max);
  std::fprintf(file, "}\n");
  return std::fclose(file) == 0 ? 0 : 1;
}
