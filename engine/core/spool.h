// SPDX-License-Identifier: MIT
#pragma once

// A sequence of records too long for memory, written once and read in order: blocks of fixed size,
// kept as scratch chunks of the store (the block number is the tile number).

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/core/store.h"

namespace rattan {

inline constexpr std::size_t kSpoolBlockBytes = std::size_t{1} << 20;

/// What a finished spool left in the store for another one.
struct SpoolExtent {
  std::uint64_t records = 0;
  std::uint32_t blocks = 0;
};

template <class A>
void members_of(A& a, SpoolExtent& e) {
  a(e.records);
  a(e.blocks);
}

/// One block is in memory while writing. Not thread safe. The chunks are erased with the spool.
template <class T>
class Spool {
  static_assert(std::is_trivially_destructible_v<T>);  // copied as bytes

 public:
  /// `field` is a store name ("stage/field") that nothing else uses.
  Spool(Store& store, std::string field, std::size_t block_bytes = kSpoolBlockBytes)
      : store_(&store),
        field_(std::move(field)),
        block_bytes_(std::max<std::size_t>(1, block_bytes / sizeof(T)) * sizeof(T)) {}
  /// Takes over what a spool of the same field left with hand_over().
  Spool(Store& store, std::string field, std::size_t block_bytes, const SpoolExtent& left)
      : Spool(store, std::move(field), block_bytes) {
    blocks_ = left.blocks;
    size_ = left.records;
  }
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  Spool(Spool&& other) noexcept
      : store_(std::exchange(other.store_, nullptr)),
        field_(std::move(other.field_)),
        block_bytes_(other.block_bytes_),
        open_(std::move(other.open_)),
        blocks_(other.blocks_),
        size_(other.size_) {}
  Spool& operator=(Spool&&) = delete;
  ~Spool() {
    try {
      erase();
    } catch (...) {  // scratch that cannot be erased is no reason to stop
    }
  }

  void append(std::span<const T> records) {
    const auto* data = reinterpret_cast<const std::byte*>(records.data());
    std::size_t left = records.size_bytes();
    while (left > 0) {
      if (!open_) {
        open_ = std::make_shared<std::vector<std::byte>>();
        open_->reserve(blocks_ == 0 ? std::min(left, block_bytes_) : block_bytes_);
      }
      const std::size_t take = std::min(left, block_bytes_ - open_->size());
      open_->insert(open_->end(), data, data + take);
      data += take;
      left -= take;
      if (open_->size() == block_bytes_) {
        flush();
      }
    }
    size_ += records.size();
  }
  void push(const T& record) { append(std::span<const T>(&record, 1)); }

  /// Ends writing. Reading needs it.
  void finish() {
    if (open_) {
      flush();
    }
  }

  std::uint64_t size() const { return size_; }
  std::uint32_t block_count() const { return blocks_; }
  std::size_t block_records() const { return block_bytes_ / sizeof(T); }
  ChunkView<T> block(std::uint32_t number) const {
    return ChunkView<T>(store_->read_chunk(field_, TileId(number)));
  }

  /// f(span of consecutive records) over the whole sequence, block by block.
  template <class F>
  void for_each_block(const F& f) const {
    for (std::uint32_t b = 0; b < blocks_; ++b) {
      const ChunkView<T> view = block(b);
      f(view.span());
    }
  }

  /// Leaves the chunks in the store, for a later spool; this one is empty then. Pre: finished.
  SpoolExtent hand_over() { return {std::exchange(size_, 0), std::exchange(blocks_, 0)}; }

  /// Frees the chunks; the spool is then empty and may be written again.
  void erase() {
    open_.reset();
    if (store_ != nullptr && blocks_ > 0) {
      store_->erase(field_);
    }
    blocks_ = 0;
    size_ = 0;
  }

 private:
  void flush() {
    store_->write_chunk(field_, TileId(blocks_), std::move(open_));
    open_.reset();
    ++blocks_;
  }

  Store* store_;
  std::string field_;
  std::size_t block_bytes_;
  std::shared_ptr<std::vector<std::byte>> open_;
  std::uint32_t blocks_ = 0;
  std::uint64_t size_ = 0;
};

/// Reads a finished spool record by record or block by block; pins one block.
template <class T>
class SpoolReader {
 public:
  explicit SpoolReader(const Spool<T>& spool) : spool_(&spool) { advance_block(); }

  bool done() const { return at_ == span_.size(); }
  const T& front() const { return span_[at_]; }
  void pop() {
    if (++at_ == span_.size()) {
      advance_block();
    }
  }
  /// The rest of the current block.
  std::span<const T> rest() const { return span_.subspan(at_); }
  /// Consumes `count` <= rest().size() records.
  void skip(std::size_t count) {
    at_ += count;
    if (at_ == span_.size()) {
      advance_block();
    }
  }

 private:
  void advance_block() {
    at_ = 0;
    if (next_ < spool_->block_count()) {
      view_ = spool_->block(next_++);
      span_ = view_.span();
    } else {
      view_ = ChunkView<T>();
      span_ = {};
    }
  }

  const Spool<T>* spool_;
  ChunkView<T> view_;
  std::span<const T> span_;
  std::size_t at_ = 0;
  std::uint32_t next_ = 0;
};

}  // namespace rattan
