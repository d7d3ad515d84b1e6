// Messages on a socket between two processes: bytes and descriptors.
#pragma once

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <vector>

namespace brume {

// A sanitizer takes address space without end, and has things to say as a process goes down.
#if defined(__has_feature)
#define BRUME_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define BRUME_SANITIZED 1
#else
#define BRUME_SANITIZED 0
#endif
constexpr bool isSanitized = BRUME_SANITIZED;
#undef BRUME_SANITIZED

struct Message {
    std::vector<uint8_t> bytes;
    std::vector<int> files;  ///< descriptors; the receiver's to close
};

constexpr size_t mostMessageBytes = size_t(256) << 20, mostMessageFiles = 4;

/// A call that a signal may interrupt, made until it is not.
template <class Call>
ssize_t uninterrupted(Call call) {
    ssize_t n;
    do n = call();
    while (n < 0 && errno == EINTR);
    return n;
}

/// False where the other end is gone.
inline bool sendMessage(int line, const Message& message) {
    uint64_t length = message.bytes.size();
    iovec part{&length, sizeof length};
    alignas(cmsghdr) char control[CMSG_SPACE(mostMessageFiles * sizeof(int))] = {};
    msghdr head{};
    head.msg_iov = &part;
    head.msg_iovlen = 1;
    if (!message.files.empty()) {
        const size_t size = message.files.size() * sizeof(int);
        head.msg_control = control;
        head.msg_controllen = CMSG_SPACE(size);
        cmsghdr* files = CMSG_FIRSTHDR(&head);
        files->cmsg_level = SOL_SOCKET;
        files->cmsg_type = SCM_RIGHTS;
        files->cmsg_len = CMSG_LEN(size);
        std::memcpy(CMSG_DATA(files), message.files.data(), size);
    }
    if (uninterrupted([&] { return sendmsg(line, &head, MSG_NOSIGNAL); }) != ssize_t(sizeof length))
        return false;
    for (size_t sent = 0; sent < message.bytes.size();) {
        const ssize_t n = uninterrupted([&] {
            return send(line, message.bytes.data() + sent, message.bytes.size() - sent, MSG_NOSIGNAL);
        });
        if (n <= 0) return false;
        sent += size_t(n);
    }
    return true;
}

/// False where the other end is gone, or talks nonsense.
inline bool receiveMessage(int line, Message& message) {
    uint64_t length = 0;
    iovec part{&length, sizeof length};
    alignas(cmsghdr) char control[CMSG_SPACE(mostMessageFiles * sizeof(int))] = {};
    msghdr head{};
    head.msg_iov = &part;
    head.msg_iovlen = 1;
    head.msg_control = control;
    head.msg_controllen = sizeof control;
    const ssize_t got = uninterrupted([&] { return recvmsg(line, &head, MSG_CMSG_CLOEXEC | MSG_WAITALL); });
    for (cmsghdr* item = got > 0 ? CMSG_FIRSTHDR(&head) : nullptr; item; item = CMSG_NXTHDR(&head, item)) {
        if (item->cmsg_level != SOL_SOCKET || item->cmsg_type != SCM_RIGHTS) continue;
        const size_t count = (item->cmsg_len - CMSG_LEN(0)) / sizeof(int), before = message.files.size();
        message.files.resize(before + count);
        std::memcpy(message.files.data() + before, CMSG_DATA(item), count * sizeof(int));
    }
    if (got != ssize_t(sizeof length) || length > mostMessageBytes) return false;
    message.bytes.resize(length);
    for (size_t at = 0; at < length;) {
        const ssize_t n =
            uninterrupted([&] { return recv(line, message.bytes.data() + at, length - at, 0); });
        if (n <= 0) return false;
        at += size_t(n);
    }
    return true;
}

}  // namespace brume
