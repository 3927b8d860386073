#include "cuda/base/queue.h"

#include <ist/types.h>

#include <numeric>
#include <vector>

#include "cuda/base/device_array.h"
#include "support/gpu_test.h"
#include "support/scarce_memory.h"

namespace ist {
namespace {

using gpu::DeviceArray;
using gpu::Queue;
using testing::ScarceMemory;

class QueueTest : public testing::GpuTest {};

TEST_F(QueueTest, ArraysTravelThereAndBackAndGrow) {
  Queue queue{GpuSettings{}};
  std::vector<int> sent(100000);
  std::iota(sent.begin(), sent.end(), 7);
  DeviceArray<int> array(queue, sent.size());
  array.upload(sent);
  EXPECT_EQ(array.to_host(sent.size()), sent);
  array.grow(3 * sent.size(), sent.size());
  EXPECT_EQ(array.size(), 3 * sent.size());
  EXPECT_EQ(array.to_host(sent.size()), sent);
  EXPECT_EQ(queue.bytes_in_use(), 3 * sent.size() * sizeof(int));
  array.release();
  EXPECT_EQ(queue.bytes_in_use(), 0u);
  EXPECT_EQ(queue.peak_bytes(), 4 * sent.size() * sizeof(int));
}

TEST_F(QueueTest, AnEndOfMemoryIsAnErrorWithAWayOutAndLeaksNothing) {
  ScarceMemory memory(1000);
  GpuSettings settings;
  settings.memory = &memory;
  Queue queue(settings);
  {
    const DeviceArray<char> fits(queue, 900);
    try {
      const DeviceArray<char> too_large(queue, 200);
      FAIL() << "200 bytes of 100 left";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("bake on the CPU"), std::string::npos)
          << error.what();
    }
  }
  queue.wait();
  EXPECT_EQ(memory.left(), 1000u);
}

TEST_F(QueueTest, ADeviceThatIsNotThereIsAnErrorWithAWayOut) {
  GpuSettings settings;
  settings.device = 1000;
  try {
    const Queue queue(settings);
    FAIL() << "there is no GPU of index 1000";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("bake on the CPU"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace ist
