// SPDX-License-Identifier: MIT
#pragma once

// Values in memory to bytes and back, on one kind of machine: for what a job keeps beside the
// store.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/core/errors.h"

namespace rattan {

class PackReader;
class PackWriter;

/// A struct says `template <class A> void members_of(A& a, S& s) { a(s.x); a(s.y); }`, found by
/// argument, if it isn't plain bytes. The same function packs and unpacks.
template <class T>
concept HasMembers = requires(PackReader& a, T& t) {
  members_of(a, t);
};
template <class T>
concept PlainBytes = std::is_trivially_destructible_v<T> && !HasMembers<T> && !std::is_pointer_v<T>;

class PackWriter {
 public:
  template <class T>
  void operator()(const T& value) {
    if constexpr (HasMembers<T>) {
      members_of(*this, const_cast<T&>(value));  // which only reads
    } else {
      static_assert(PlainBytes<T>);
      bytes(&value, sizeof value);
    }
  }
  void operator()(const std::string& text) {
    (*this)(std::uint64_t{text.size()});
    bytes(text.data(), text.size());
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(std::uint64_t{values.size()});
    if constexpr (PlainBytes<T>) {
      bytes(values.data(), values.size() * sizeof(T));
    } else {
      for (const T& v : values) {
        (*this)(v);
      }
    }
  }
  template <class K, class V>
  void operator()(const std::map<K, V>& values) {
    (*this)(std::uint64_t{values.size()});
    for (const auto& [key, value] : values) {
      (*this)(key);
      (*this)(value);
    }
  }
  std::string take() { return std::move(out_); }

 private:
  void bytes(const void* from, std::size_t size) {
    out_.append(static_cast<const char*>(from), size);
  }
  std::string out_;
};

/// Throws InternalError where the bytes end early.
class PackReader {
 public:
  explicit PackReader(std::string_view in) : in_(in) {}

  template <class T>
  void operator()(T& value) {
    if constexpr (HasMembers<T>) {
      members_of(*this, value);
    } else {
      static_assert(PlainBytes<T>);
      bytes(&value, sizeof value);
    }
  }
  void operator()(std::string& text) {
    text.resize(count(1));
    bytes(text.data(), text.size());
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    if constexpr (PlainBytes<T>) {
      values.resize(count(sizeof(T)));
      bytes(values.data(), values.size() * sizeof(T));
    } else {
      values.resize(count(1));
      for (T& v : values) {
        (*this)(v);
      }
    }
  }
  template <class K, class V>
  void operator()(std::map<K, V>& values) {
    for (std::size_t left = count(1); left > 0; --left) {
      K key{};
      (*this)(key);
      (*this)(values[std::move(key)]);
    }
  }
  bool done() const { return in_.empty(); }

 private:
  std::size_t count(std::size_t least_bytes) {
    std::uint64_t n = 0;
    (*this)(n);
    ensure(n <= in_.size() / least_bytes, "packed values are complete");
    return static_cast<std::size_t>(n);
  }
  void bytes(void* to, std::size_t size) {
    ensure(size <= in_.size(), "packed values are complete");
    if (size > 0) {
      std::memcpy(to, in_.data(), size);
    }
    in_.remove_prefix(size);
  }
  std::string_view in_;
};

template <class T>
std::string pack(const T& value) {
  PackWriter out;
  out(value);
  return out.take();
}

template <class T>
void unpack(std::string_view bytes, T& value) {
  PackReader in(bytes);
  in(value);
  ensure(in.done(), "packed values end where they should");
}

}  // namespace rattan
