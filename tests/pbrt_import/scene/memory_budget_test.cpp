#include "pbrt_import/base/memory_budget.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

TEST(MemoryBudget, ReservationsAreGivenBack) {
  const MemoryBudget budget(1000), same = budget;
  {
    MemoryReservation a(budget, 600, "a");
    MemoryReservation b(same);
    b.cover(300, "b");
    b.cover(200, "b");
    EXPECT_EQ(budget.used(), 900u);
    b.resize(100, "b");
    EXPECT_EQ(budget.left(), 300u);
    a.merge(std::move(b));
    EXPECT_EQ(a.bytes(), 700u);
    const MemoryReservation moved = std::move(a);
    EXPECT_EQ(budget.used(), 700u);
  }
  EXPECT_EQ(budget.used(), 0u);
}

TEST(MemoryBudget, RefusalSaysWhatIsNeededAndLeft) {
  const MemoryBudget budget(uint64_t{2} << 30);
  MemoryReservation reservation(budget, 1 << 20, "a");
  try {
    reservation.resize(uint64_t{37} << 27, "the shape");
    ADD_FAILURE() << "accepted";
  } catch (const MemoryError& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_STREQ(error.what(), "the shape needs 4.6 GiB of memory, of 2.0 GiB left; --max-memory raises it");
  }
  EXPECT_EQ(budget.used(), uint64_t{1} << 20);
  EXPECT_THROW(reservation.resize(UINT64_MAX, "all"), MemoryError);
}

TEST(MemoryBudget, ReservationsOfNoBudgetAreNotCounted) {
  MemoryReservation reservation;
  reservation.cover(UINT64_MAX, "anything");
  EXPECT_EQ(reservation.bytes(), UINT64_MAX);
}

TEST(MemoryBudget, ThreadsNeverTakeMoreThanThereIs) {
  const MemoryBudget budget(1000);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 10'000; ++i) {
        try {
          const MemoryReservation reservation(budget, 300, "a");
          EXPECT_LE(budget.used(), 1000u);
        } catch (const MemoryError&) {
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(budget.used(), 0u);
}

TEST(MemoryBudget, SizesAreReadInAllTheirForms) {
  for (const auto& [text, bytes] :
       std::initializer_list<std::pair<const char*, uint64_t>>{{"1000000", 1000000},
                                                               {"512M", 512u << 20},
                                                               {"512m", 512u << 20},
                                                               {"8G", uint64_t{8} << 30},
                                                               {"1.5GiB", uint64_t{3} << 29},
                                                               {"64KB", 65536},
                                                               {"50%", 500},
                                                               {"2T", uint64_t{2} << 40},
                                                               {"10B", 10}})
    EXPECT_EQ(parse_memory_size(text, 1000), bytes) << text;
  for (const char* const text :
       {"", "0", "-1", "many", "5 G", "5X", "0.5", "nan", "inf", "1e9", "%", "5GG", "5%%", "0%"})
    EXPECT_THROW(parse_memory_size(text, 1000), Error) << text;
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(MemoryBudget, ControlGroupsOfBothVersionsLimitIt) {
  const TemporaryFolder folder;
  write(folder / "outer/memory.max", "3000000\n");
  write(folder / "outer/inner/memory.max", "max\n");
  write(folder / "memory/jobs/memory.limit_in_bytes", "2000000\n");
  write(folder / "memory/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(control_group_memory("0::/outer/inner\n", folder.path()), 3000000u);
  EXPECT_EQ(control_group_memory("0::/\n", folder.path()), UINT64_MAX);
  EXPECT_EQ(control_group_memory("4:cpu,memory:/jobs/7\n1:name=systemd:/jobs\n", folder.path()), 2000000u);
  EXPECT_EQ(control_group_memory("4:memory:/jobs\n0::/outer\n", folder.path()), 2000000u);
  EXPECT_EQ(control_group_memory("nonsense", folder.path()), UINT64_MAX);
}

TEST(MemoryBudget, DefaultIsHalfOfTheMachine) {
  EXPECT_EQ(MemoryBudget().limit(), machine_memory() / 2);
  EXPECT_GT(machine_memory(), uint64_t{1} << 20);
}

} // namespace
} // namespace packtrace
