// A lander's state as bytes, and back: a header that identifies them, then the struct itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <vector>

#include "engine/lander.hpp"

namespace touchdown::engine {

// Raised with every change to `Lander` that leaves its size unchanged.
inline constexpr std::uint32_t kSnapshotVersion = 2;

struct SnapshotHeader {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t size;
  std::uint64_t checksum;
};

inline constexpr std::array<char, 8> kSnapshotMagic = {'T', 'D', 'L', 'A', 'N', 'D', 'E', 'R'};

// FNV-1a: it detects accidents, and is no defence against intent.
inline std::uint64_t checksum(std::span<const std::byte> bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const std::byte byte : bytes) {
    hash ^= static_cast<std::uint64_t>(byte);
    hash *= 0x100000001b3u;
  }
  return hash;
}

inline std::vector<std::byte> snapshot(const Lander& lander) {
  std::vector<std::byte> bytes(sizeof(SnapshotHeader) + sizeof(Lander));
  std::byte* body = bytes.data() + sizeof(SnapshotHeader);
  std::memcpy(body, &lander, sizeof(Lander));
  const SnapshotHeader header{kSnapshotMagic, kSnapshotVersion, sizeof(Lander),
                              checksum({body, sizeof(Lander)})};
  std::memcpy(bytes.data(), &header, sizeof(header));
  return bytes;
}

// Throws std::invalid_argument if the bytes are not a snapshot of a lander with this config.
inline Lander restored(std::span<const std::byte> bytes, const Config& config) {
  SnapshotHeader header;
  if (bytes.size() < sizeof(header)) throw std::invalid_argument("too short for a snapshot");
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.magic != kSnapshotMagic) throw std::invalid_argument("not a snapshot of a lander");
  if (header.version != kSnapshotVersion || header.size != sizeof(Lander)) {
    throw std::invalid_argument("a snapshot of another version of the engine");
  }
  const auto body = bytes.subspan(sizeof(header));
  if (body.size() != sizeof(Lander) || checksum(body) != header.checksum) {
    throw std::invalid_argument("the snapshot is damaged");
  }
  Lander lander;
  std::memcpy(&lander, body.data(), sizeof(Lander));
  if (!is_sound(lander)) throw std::invalid_argument("the snapshot is damaged");
  if (!(lander.config == config)) {
    throw std::invalid_argument("the snapshot is of a lander with other settings");
  }
  return lander;
}

}  // namespace touchdown::engine
