// Frames and payloads: check values, golden vectors in both directions, and bytes of no meaning.

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "check.hpp"
#include "host.hpp"

using namespace chalumeau;

CLAIM(crc_has_its_check_value) { CHECK(crc32(reinterpret_cast<const std::uint8_t*>("123456789"), 9) == 0xCBF43926U); }

CLAIM(cobs_gives_back_every_pattern_of_zeros) {
    for (unsigned pattern = 0; pattern < 1024; ++pattern) {
        std::uint8_t bytes[10];
        std::uint8_t stuffed[11];
        for (unsigned i = 0; i < 10; ++i) {
            bytes[i] = (pattern >> i & 1U) != 0 ? static_cast<std::uint8_t>(i + 1) : 0;
        }
        const std::size_t length = cobs_encode(bytes, 10, stuffed);
        CHECK(length == 11 && std::memchr(stuffed, 0, length) == nullptr);
        CHECK(cobs_decode(stuffed, length) == 10 && std::memcmp(stuffed, bytes, 10) == 0);
    }
}

namespace {

std::vector<std::uint8_t> from_hex(const std::string& text) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
        bytes.push_back(static_cast<std::uint8_t>(std::strtoul(text.substr(i, 2).c_str(), nullptr, 16)));
    }
    return bytes;
}

/// `name=value` pairs as a list line gives them.
std::map<std::string, std::string> fields_of(const std::string& text) {
    std::map<std::string, std::string> fields;
    std::istringstream words(text);
    std::string word;
    while (words >> word) {
        const std::size_t at = word.find('=');
        fields[word.substr(0, at)] = at == std::string::npos ? "" : word.substr(at + 1);
    }
    return fields;
}

bool equal(std::uint64_t value, const std::string& text) { return std::strtoull(text.c_str(), nullptr, 10) == value; }
bool equal(std::int32_t value, const std::string& text) { return std::strtol(text.c_str(), nullptr, 10) == value; }
bool equal(float value, const std::string& text) {
    const float wanted = std::strtof(text.c_str(), nullptr);
    return std::memcmp(&wanted, &value, sizeof value) == 0;
}

/// Decodes, compares every field listed, and encodes again.
struct Read {
    const char* verdict = "unknown";
    Payload again;
    unsigned fields = 0;
    bool same = true;
};

template <typename Kind>
void compare(Read& read, Kind value, const std::string& text) {
    ++read.fields;
    read.same = read.same && equal(value, text);
}
#define FIELD(message, name, kind) compare(read, static_cast<kind>((message).name), fields[#name])

template <typename Message>
bool opens(Message& message, const Frame& frame, Read& read) {
    if (!message.decode(frame.payload, frame.length)) {
        read.verdict = "length";
        return false;
    }
    read.again = message.encode();
    return true;
}

template <typename Message>
void judge(const Message& message, Read& read) {
    read.verdict = message.ranges().code == Refusal::None ? "ok" : "range";
}

Read read_message(const Frame& frame, std::map<std::string, std::string> fields) {
    Read read;
    using u = std::uint64_t;
    switch (static_cast<Type>(frame.type)) {
        case Type::Hello: {
            Hello m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, major, u), FIELD(m, minor, u), FIELD(m, session, u);
            }
            break;
        }
        case Type::Feel: {
            Feel m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, feel_id, u), FIELD(m, law, u), FIELD(m, morph_ms, u), FIELD(m, friction, u);
                FIELD(m, detent, u), FIELD(m, h, float), FIELD(m, k, float), FIELD(m, scale_mnm, float);
                FIELD(m, stretch, float), FIELD(m, offset_deg, float), FIELD(m, a_on_deg, float);
                FIELD(m, a_off_deg, float), FIELD(m, a_beat_deg, float), FIELD(m, wall_deg, float);
                FIELD(m, wall_mnm_per_deg, float), FIELD(m, slap_mnm_per_deg, float), FIELD(m, damping_mnms, float);
            }
            break;
        }
        case Type::Arm:
        case Type::Alive: {
            Arm m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, session, u), FIELD(m, ceiling_mnm, u);
                if (m.stamped) {
                    FIELD(m, epoch, u), FIELD(m, heard_us, u);
                }
            }
            break;
        }
        case Type::Free: read.verdict = "ok"; break;
        case Type::Zero: {
            Zero m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, angle, std::int32_t);
            }
            break;
        }
        case Type::Rate: {
            Rate m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, hz, u);
            }
            break;
        }
        case Type::Bye: {
            Bye m;
            if (opens(m, frame, read)) {
                read.verdict = "ok";
                FIELD(m, session, u);
            }
            break;
        }
        case Type::Info: {
            Info m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, major, u), FIELD(m, minor, u), FIELD(m, capabilities, u), FIELD(m, firmware_major, u);
                FIELD(m, firmware_minor, u), FIELD(m, firmware_patch, u), FIELD(m, serial, u);
                FIELD(m, counts_per_turn, u), FIELD(m, loop_hz, u), FIELD(m, watchdog_ms, u), FIELD(m, fade_ms, u);
                FIELD(m, ceiling_mnm, u), FIELD(m, session, u), FIELD(m, stiffness_limit, u), FIELD(m, push_limit, u);
                if (m.counted) {
                    FIELD(m, overruns, u), FIELD(m, bus_errors, u);
                }
                const std::vector<std::uint8_t> name = from_hex(fields["name"]);
                ++read.fields;
                read.same = read.same && (std::strcmp(read.verdict, "ok") != 0 ||
                                          (name.size() == 16 && std::memcmp(name.data(), m.name, 16) == 0));
            }
            break;
        }
        case Type::State: {
            State m;
            if (opens(m, frame, read)) {
                read.verdict = "ok";
                FIELD(m, t_us, u), FIELD(m, angle, std::int32_t), FIELD(m, velocity, std::int32_t);
                FIELD(m, torque, std::int32_t), FIELD(m, flags, u), FIELD(m, feel_id, u), FIELD(m, slaps, u);
                FIELD(m, events, u), FIELD(m, fault, u);
                if (m.stamped) {
                    FIELD(m, epoch, u);
                }
            }
            break;
        }
        case Type::Event: {
            Event m;
            if (opens(m, frame, read)) {
                judge(m, read);
                FIELD(m, kind, u), FIELD(m, counter, u), FIELD(m, code, u), FIELD(m, feel_id, u);
                FIELD(m, t_us, u), FIELD(m, value, float);
            }
            break;
        }
    }
    return read;
}

/// Every line of a list against the C++ codec. Returns the lines.
template <typename Decoder, typename Dress>
int read_list(const char* name, Dress dress) {
    std::ifstream list(test::options().golden + "/" + name);
    if (!list) {
        std::printf("    cannot read %s/%s; run `cargo xtask wire-vectors`\n", test::options().golden.c_str(), name);
        CHECK(false);
        return 0;
    }
    std::string line;
    std::getline(list, line);
    int lines = 0;
    while (std::getline(list, line)) {
        std::vector<std::string> columns;
        std::istringstream cells(line);
        std::string cell;
        while (std::getline(cells, cell, '\t')) {
            columns.push_back(cell);
        }
        CHECK(columns.size() == 7);
        if (columns.size() != 7) {
            continue;
        }
        ++lines;
        const std::string& verdict = columns[1];
        const int before = test::failures();
        const std::vector<std::uint8_t> bytes = from_hex(columns[6]);
        std::ifstream file(test::options().golden + "/" + columns[0], std::ios::binary);
        const std::string kept((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
        CHECK(kept == std::string(bytes.begin(), bytes.end()));
        Decoder decoder;
        Frame frame;
        bool whole = false;
        for (std::uint8_t byte : bytes) {
            whole = decoder.push(byte, frame) || whole;
        }
        if (!whole) {
            const FrameCounts& counts = decoder.reader.counts;
            CHECK(verdict == (counts.crc_errors > 0 ? "crc" : "length") && counts.crc_errors + counts.junk > 0);
        } else {
            const Read read = read_message(frame, fields_of(columns[4]));
            CHECK(verdict == read.verdict);
            char type[8];
            std::snprintf(type, sizeof type, "0x%02x", frame.type);
            CHECK(columns[2] == type && columns[3] == std::to_string(frame.seq));
            if (verdict == "ok") {
                CHECK(read.same);
                CHECK(columns[4] == "-" ? read.fields == 0 : fields_of(columns[4]).size() == read.fields);
            }
            if (columns[5] == "yes") {
                std::uint8_t body[FRAME_MAX];
                std::uint8_t wire[SYSEX_MAX];
                const std::size_t length =
                    frame_encode(frame.type, frame.seq, read.again.bytes, read.again.length, body);
                const std::size_t end = dress(body, length, wire);
                CHECK(std::vector<std::uint8_t>(wire, wire + end) == bytes);
            }
        }
        if (test::failures() != before) {
            std::printf("    in %s\n", columns[0].c_str());
        }
    }
    return lines;
}

}  // namespace

CLAIM(golden_frames_are_read_and_written_byte_for_byte) {
    const int lines = read_list<SerialDecoder>("list.tsv", serial_encode);
    CHECK(lines > 100);
    std::printf("    %d serial vectors\n", lines);
}

CLAIM(golden_sysex_is_read_and_written_byte_for_byte) {
    const int lines = read_list<MidiDecoder>("midi.tsv", sysex_encode);
    CHECK(lines > 30);
    std::printf("    %d MIDI vectors\n", lines);
}

CLAIM(frame_behind_any_damage_is_received) {
    test::Random random(1);
    Payload payload = Arm{0xDEADBEEF, 100}.encode();
    for (int trial = 0; trial < 20000; ++trial) {
        SerialDecoder decoder;
        Frame frame;
        std::uint8_t body[FRAME_MAX];
        std::uint8_t wire[SERIAL_FRAME_MAX];
        const std::size_t length = frame_encode(4, 9, payload.bytes, payload.length, body);
        const std::size_t end = serial_encode(body, length, wire);
        const std::uint32_t noise = random.below(200);
        for (std::uint32_t i = 0; i < noise; ++i) {
            decoder.push(random.byte(), frame);
        }
        // A cut frame right before a good one: only its own bytes are lost.
        for (std::size_t i = 0; i < random.below(static_cast<std::uint32_t>(end)); ++i) {
            decoder.push(wire[i], frame);
        }
        bool whole = false;
        for (std::size_t i = 0; i < end; ++i) {
            whole = decoder.push(wire[i], frame);
        }
        CHECK(whole && frame.type == 4 && frame.seq == 9);
    }
}

CLAIM(no_damaged_byte_passes) {
    Payload payload = test::reference_feel().encode();
    std::uint8_t body[FRAME_MAX];
    std::uint8_t wire[SERIAL_FRAME_MAX];
    const std::size_t end = serial_encode(body, frame_encode(2, 1, payload.bytes, payload.length, body), wire);
    for (std::size_t at = 1; at + 1 < end; ++at) {
        for (unsigned flip = 1; flip < 256; ++flip) {
            SerialDecoder decoder;
            Frame frame;
            bool whole = false;
            for (std::size_t i = 0; i < end; ++i) {
                whole = decoder.push(static_cast<std::uint8_t>(wire[i] ^ (i == at ? flip : 0)), frame) || whole;
            }
            CHECK(!whole);
        }
    }
}

/// Random bytes, half of them near the alphabet of real frames; and a whole armed device behind the decoders, so that
/// whatever a false frame did would be seen.
CLAIM(random_bytes_neither_crash_nor_hang_nor_move_the_knob) {
    test::Random random(2);
    SerialDecoder serial;
    MidiDecoder midi;
    test::Bench bench;
    Frame frame;
    unsigned long long by_serial = 0;
    unsigned long long by_midi = 0;
    unsigned long long whole = 0;
    const unsigned long long total = test::options().fuzz_bytes;
    Payload payload = test::reference_feel().encode();
    std::uint8_t body[FRAME_MAX];
    std::uint8_t wire[SERIAL_FRAME_MAX];
    const std::size_t end = serial_encode(body, frame_encode(2, 1, payload.bytes, payload.length, body), wire);
    std::uint8_t chunk[256];
    for (unsigned long long done = 0; done < total; done += sizeof chunk) {
        const std::uint32_t mood = random.below(3);
        for (std::size_t i = 0; i < sizeof chunk; ++i) {
            const std::uint8_t byte = random.byte();
            chunk[i] = mood == 0 ? byte : (byte < 12 ? 0 : (mood == 1 ? static_cast<std::uint8_t>(byte % 9) : byte));
        }
        if (mood == 2) {
            // A real FEEL with up to four bytes struck, in the middle of it all.
            std::memcpy(chunk + 90, wire, end);
            for (std::uint32_t hits = 1 + random.below(4); hits > 0; --hits) {
                std::uint8_t& struck = chunk[90 + random.below(static_cast<std::uint32_t>(end))];
                struck = static_cast<std::uint8_t>(struck ^ (1U + random.below(255)));
            }
            // Struck twice in one place a byte may be itself again.
            whole += std::memcmp(chunk + 90, wire, end) == 0 ? 1 : 0;
        }
        for (std::uint8_t byte : chunk) {
            by_serial += serial.push(byte, frame) ? 1 : 0;
            by_midi += midi.push(byte, frame) ? 1 : 0;
        }
        bench.device.receive(chunk, sizeof chunk);
        bench.device.receive_midi(chunk, sizeof chunk);
        if ((done & 0xFFFFFU) == 0) {
            CHECK(bench.tick() == 0.0F);
        }
    }
    const FrameCounts& counts = serial.reader.counts;
    std::printf(
        "    %llu bytes: %u stretches of junk, %u checksum errors; frames: %llu sent, %llu by serial, %llu by MIDI\n",
        total, counts.junk, counts.crc_errors, whole, by_serial, by_midi);
    CHECK(!bench.device.armed());
    CHECK(counts.crc_errors > total / 10000);
    // The odds of a 32-bit checksum for all tries together: about 1 in 10,000 at 10^8 bytes.
    CHECK(by_serial == whole && by_midi == 0);
    CHECK(bench.device.feel().law == static_cast<std::uint8_t>(Law::Free));
}
