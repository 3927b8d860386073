// A haptic loop at 1 kHz or more: a hand moves a device, a proxy on a virtual coupling touches the
// object, and the device renders the coupling. Records latency, force and torque, and whether the
// loop is passive. Links ist::query alone.
#include <ist/deadline.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <optional>
#include <thread>
#include <vector>

#include "asset_file.h"
#include "hand.h"
#include "latency.h"
#include "options.h"
#include "proxy.h"

namespace {

/// What the hand does: one of the three motions.
class Motion {
 public:
  Motion(const Options& options, const ist::AssetView& object, const ist::AssetView& probe)
      : insert_(options) {
    if (std::strcmp(options.motion, "stroke") == 0)
      stroke_.emplace(object.volume(), probe.volume() * std::pow(options.scale, 3));
    else if (std::strcmp(options.motion, "insert") != 0)
      recorded_.emplace(options.motion);
  }

  /// Only a stroke depends on what was answered.
  bool feels() const { return stroke_.has_value(); }
  void move(const ist::PenetrationAndSeparation& contact, double seconds) {
    if (stroke_) stroke_->move(contact, seconds);
  }
  HandPose at(double time) const {
    return stroke_ ? stroke_->pose() : recorded_ ? recorded_->at(time) : insert_.at(time);
  }

 private:
  Insert insert_;
  std::optional<Stroke> stroke_;
  std::optional<Recorded> recorded_;
};

/// The simulation of a tick, without its clock.
class Session {
 public:
  Session(const Options& options, const ist::AssetView& object, const ist::AssetView& probe,
          double coupling_hz)
      : motion_(options, object, probe),
        object_(object),
        probe_(probe),
        scale_(options.scale),
        period_(1 / options.rate),
        exact_(options.exact),
        deadline_us_(options.deadline_us),
        deadline_(options.deadline_us),
        proxy_({probe, {}, options.scale}, coupling_hz, options.contact_hz) {
    // A stroke begins where it touches: the first answers also bring memory and caches up.
    for (int i = 0; i < 100; ++i) {
      proxy_.place(motion_.at(0));
      motion_.move(ask(), 1e-3);
    }
    proxy_.place(motion_.at(0));
    hand_ = motion_.at(0);
  }

  /// The query alone: what a loop waits for.
  ist::PenetrationAndSeparation ask() {
    const ist::PlacedAsset a{object_, {}}, b{probe_, pose_of(proxy_.pose()), scale_};
    ist::PenetrationSettings settings;
    if (exact_) settings.measure = ist::Measure::exact;
    settings.pair_id = 1;  // a loop: what is near is kept from tick to tick
    deadline_.limit(settings);
    const double start = now_us();
    ist::PenetrationAndSeparation answer{ist::penetration(a, b, settings, scratch_), {}};
    deadline_.record(answer.penetration, now_us() - start);
    // The hand asks for the gap while there is one. In bounded time only the inner spheres tell it.
    if (motion_.feels() && !(answer.penetration.volume > 0)) {
      answer.separation =
          ist::separation(a, b, {.inner_spheres = deadline_us_ > 0, .pair_id = 1}, scratch_);
    }
    return answer;
  }

  Felt step(const ist::PenetrationAndSeparation& contact) {
    motion_.move(contact, period_);
    time_ += period_;
    const HandPose next = motion_.at(time_);
    const Felt felt = proxy_.step(hand_, next, contact.penetration, period_);
    hand_ = next;
    passivity_.count(felt);
    return felt;
  }

  double time() const { return time_; }
  const HandPose& hand() const { return hand_; }
  const Proxy& proxy() const { return proxy_; }
  const Passivity& passivity() const { return passivity_; }
  bool too_slow() const { return deadline_.too_slow(); }

 private:
  Motion motion_;
  ist::AssetView object_, probe_;
  double scale_, period_, time_ = 0;
  bool exact_;
  double deadline_us_;
  ist::Deadline deadline_;
  ist::Workspace scratch_;
  Proxy proxy_;
  HandPose hand_;
  Passivity passivity_;
};

struct Row {
  double time;
  HandPose hand, proxy;
  Felt felt;
  double volume;
};

bool write_trace(const char* path, const std::vector<Row>& rows) {
  std::FILE* const file = std::fopen(path, "w");
  if (file == nullptr) return std::fprintf(stderr, "%s: cannot write\n", path), false;
  std::fputs("t,x,y,z,qw,qx,qy,qz,px,py,pz,fx,fy,fz,tx,ty,tz,volume,from_hand,stored\n", file);
  for (const Row& row : rows) {
    const auto& [t, hand, proxy, felt, volume] = row;
    const double values[] = {hand.place.x(),  hand.place.y(),  hand.place.z(),  hand.turn.w(),
                             hand.turn.x(),   hand.turn.y(),   hand.turn.z(),   proxy.place.x(),
                             proxy.place.y(), proxy.place.z(), felt.force.x(),  felt.force.y(),
                             felt.force.z(),  felt.torque.x(), felt.torque.y(), felt.torque.z(),
                             volume,          felt.from_hand,  felt.stored};
    std::fprintf(file, "%.9g", t);
    for (const double value : values) std::fprintf(file, ",%.9g", value);
    std::fputs("\n", file);
  }
  return std::fclose(file) == 0;
}

/// The motion at a coupling, as fast as it goes.
Passivity rehearse(const Options& options, const ist::AssetView& object,
                   const ist::AssetView& probe, double coupling_hz) {
  Session session(options, object, probe, coupling_hz);
  const auto ticks = static_cast<std::size_t>(std::ceil(options.seconds * options.rate));
  for (std::size_t i = 0; i < ticks && session.passivity().deficit < INFINITY; ++i)
    session.step(session.ask());
  return session.passivity();
}

/// [Hz] The stiffest coupling, to 2 %, up to which the motion stays passive; 0 if none is.
double stiffest_passive(const Options& options, const ist::AssetView& object,
                        const ist::AssetView& probe) {
  double kept = 0, lost = 0;
  for (double hz = options.rate / 200; lost == 0 && hz < options.rate; hz *= 1.3)
    (rehearse(options, object, probe, hz).kept() ? kept : lost) = hz;
  if (kept == 0) return 0;
  while (lost > 1.02 * kept) {
    const double hz = std::sqrt(kept * lost);
    (rehearse(options, object, probe, hz).kept() ? kept : lost) = hz;
  }
  return kept;
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const ist::AssetView object = map_asset(options.object), probe = map_asset(options.probe);
  if (options.exact && !(object.has_mesh() && probe.has_mesh())) {
    std::fputs("--exact: both assets need their meshes; bake them without --keep-mesh no\n",
               stderr);
    return 1;
  }
  double stiffest = 0;
  if (options.search) {
    stiffest = stiffest_passive(options, object, probe);
    const double omega = 2 * std::numbers::pi * stiffest;
    std::printf("stiffest coupling that is passive: %.1f Hz, %.4g times the probe's mass a s2\n",
                stiffest, omega * omega);
  }
  Session session(options, object, probe, options.coupling_hz);
  const double period = 1e6 / options.rate;  // [µs]
  const auto ticks = static_cast<std::size_t>(std::ceil(options.seconds * options.rate));
  std::vector<double> overslept, asked, ticked, late;  // [µs] one a tick
  for (std::vector<double>* const times : {&overslept, &asked, &ticked, &late})
    times->reserve(ticks);
  std::vector<Row> rows;
  if (options.trace != nullptr) rows.reserve(ticks);

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
  prctl(PR_SET_TIMERSLACK, 1UL);  // else the system wakes what has no priority 50 µs late

  Missed missed;
  std::size_t made = 0, skipped = 0, touching = 0, too_slow = 0, over = 0;
  double largest_force = 0, largest_torque = 0;
  double due = now_us() + period;
  for (; made + skipped < ticks; ++made) {
    if (options.offline)
      due = now_us();
    else
      sleep_until(due);
    const double woken = now_us();
    const double ran = clock_us(CLOCK_THREAD_CPUTIME_ID);
    const HandPose hand = session.hand(), proxy = session.proxy().pose();
    const double time = session.time();
    const double called = now_us();
    const ist::PenetrationAndSeparation contact = session.ask();
    const double answered = now_us();
    const Felt felt = session.step(contact);  // a device would be sent felt.force and felt.torque
    const double computed = clock_us(CLOCK_THREAD_CPUTIME_ID) - ran;
    const double done = now_us();
    overslept.push_back(woken - due);
    asked.push_back(answered - called);
    ticked.push_back(done - woken);
    late.push_back(done - due);
    if (contact.penetration.volume > 0) ++touching;
    if (session.too_slow()) ++too_slow;
    if (options.deadline_us > 0 && asked.back() > options.deadline_us) ++over;
    largest_force = std::max(largest_force, felt.force.norm());
    largest_torque = std::max(largest_torque, felt.torque.norm());
    if (options.trace != nullptr)
      rows.push_back({time, hand, proxy, felt, contact.penetration.volume});
    due += period;
    if (done > due) {  // the next tick was due before this one had its force
      missed.count(computed, ticked.back(), period);
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
  } times[] = {
      {"timer", "overslept_us", "from the tick to being woken", quantiles(overslept)},
      {"query", "query_us", "from call to answer", quantiles(asked)},
      {"tick", "tick_us", "from being woken to the force", quantiles(ticked)},
      {"late", "late_us", "from the tick to the force", quantiles(late)},
  };
  const Passivity& passivity = session.passivity();
  std::printf("%zu ticks at %g Hz, %zu in contact, %d load threads%s\n", made, options.rate,
              touching, options.load, fifo ? ", real-time priority" : "");
  std::printf("[us]      p50      p99    p99.9      max\n");
  for (const auto& row : times)
    std::printf("%-5s %7.1f  %7.1f  %7.1f  %7.1f   %s\n", row.name, row.us.p50, row.us.p99,
                row.us.p999, row.us.max, row.text);
  std::printf(
      "missed deadlines: %zu, of them %zu by the tick's own work, %zu by an overslept timer, %zu "
      "interrupted;\n"
      "ticks skipped after them: %zu\n",
      missed.all(), missed.work, missed.timer, missed.interrupted, skipped);
  if (options.deadline_us > 0) {
    std::printf("queries later than their %g us: %zu; ticks whose deadline no budget keeps: %zu\n",
                options.deadline_us, over, too_slow);
  }
  std::printf("%s: the hand got %.3g more than it had put in, of %.3g stored at most\n",
              passivity.kept() ? "passive" : "not passive", passivity.deficit, passivity.peak);
  if (options.trace != nullptr && !write_trace(options.trace, rows)) return 1;
  if (options.json == nullptr) return 0;
  std::FILE* const file = std::fopen(options.json, "w");
  if (file == nullptr) return std::fprintf(stderr, "%s: cannot write\n", options.json), 1;
  std::fprintf(file,
               "{\"ticks\": %zu, \"rate_hz\": %g, \"load_threads\": %d, \"fifo\": %s,\n"
               " \"object_spheres\": %zu, \"probe_spheres\": %zu, \"in_contact\": %zu,\n"
               " \"missed\": %zu, \"missed_by_work\": %zu, \"missed_by_timer\": %zu,\n"
               " \"interrupted\": %zu, \"skipped\": %zu, \"too_slow\": %zu, \"queries_over\": %zu",
               made, options.rate, options.load, fifo ? "true" : "false", object.sphere_count(),
               probe.sphere_count(), touching, missed.all(), missed.work, missed.timer,
               missed.interrupted, skipped, too_slow, over);
  std::fprintf(file,
               ",\n \"coupling_hz\": %g, \"stiffness\": %g, \"turning_stiffness\": %g,\n"
               " \"largest_force\": %g, \"largest_torque\": %g,\n"
               " \"passive\": %s, \"deficit\": %g, \"deficit_bound\": %g, \"peak_stored\": %g",
               options.coupling_hz, session.proxy().stiffness(),
               session.proxy().turning_stiffness(), largest_force, largest_torque,
               passivity.kept() ? "true" : "false", passivity.deficit,
               Passivity::kBound * passivity.peak, passivity.peak);
  if (options.search) std::fprintf(file, ",\n \"stiffest_passive_hz\": %g", stiffest);
  for (const auto& row : times)
    std::fprintf(file, ",\n \"%s\": {\"p50\": %.3f, \"p99\": %.3f, \"p99.9\": %.3f, \"max\": %.3f}",
                 row.key, row.us.p50, row.us.p99, row.us.p999, row.us.max);
  std::fprintf(file, "}\n");
  return std::fclose(file) == 0 ? 0 : 1;
}
