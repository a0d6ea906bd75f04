// The library's version; CMake reads it from here.
#pragma once

#define PACKET_VERSION_MAJOR 0
#define PACKET_VERSION_MINOR 1
#define PACKET_VERSION_PATCH 0
