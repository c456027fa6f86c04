#include "pbrt_import/base/large_pages.h"

#include <algorithm>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

TEST(LargePages, ElementsStayWhileRoomGrows) {
  std::vector<std::unique_ptr<std::string>> elements;
  for (int i = 0; i < 40'000; ++i) {
    const size_t capacity = elements.capacity();
    reserve_one_more(elements);
    ASSERT_GT(elements.capacity(), elements.size());
    if (elements.size() < capacity) {
      ASSERT_EQ(elements.capacity(), capacity) << "there was room";
    }
    elements.push_back(std::make_unique<std::string>(std::to_string(i)));
  }
  for (int i = 0; i < 40'000; ++i) ASSERT_EQ(*elements[static_cast<size_t>(i)], std::to_string(i));
}

TEST(LargePages, LargeRoomIsMovedInto) {
  std::vector<uint32_t> numbers{1, 2, 3};
  reserve_large(numbers, size_t{1} << 22); // 16 MiB: uses large pages
  EXPECT_EQ(numbers, (std::vector<uint32_t>{1, 2, 3}));
  EXPECT_GE(numbers.capacity(), size_t{1} << 22);
  numbers.resize(size_t{1} << 22, 7u);
  EXPECT_EQ(numbers.back(), 7u);
}

TEST(LargePages, BlocksKeepWhatIsWrittenToThem) {
  LargeHeapPages heap_pages;
  std::vector<std::vector<uint32_t>> blocks;
  for (uint32_t i = 0; i < 3000; ++i) { // 48 MB in total: the heap is prepared several times
    constexpr size_t kNumbers = 4000;
    heap_pages.about_to_allocate(kNumbers * sizeof(uint32_t));
    blocks.emplace_back(kNumbers, i);
  }
  for (uint32_t i = 0; i < blocks.size(); ++i) {
    ASSERT_EQ(blocks[i].front(), i);
    ASSERT_EQ(blocks[i].back(), i);
  }
}

TEST(LargePages, TheHeapServesBlocksAfterItIsPrepared) {
  std::vector<std::vector<uint32_t>> blocks;
  for (uint32_t i = 0; i < 100; ++i) { // 100 MB in total: more than was prepared
    if (i % 50 == 0) prefer_large_heap_pages(size_t{30} << 20);
    blocks.emplace_back(size_t{250'000}, i);
  }
  for (uint32_t i = 0; i < blocks.size(); ++i)
    ASSERT_EQ(std::count(blocks[i].begin(), blocks[i].end(), i), 250'000) << i;
}

} // namespace
} // namespace packtrace
