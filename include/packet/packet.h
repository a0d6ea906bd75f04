// Everything public.
#pragma once

#include <packet/accel.h>
#include <packet/bounds.h>
#include <packet/error.h>
#include <packet/gltf.h>
#include <packet/hit.h>
#include <packet/isa.h>
#include <packet/mesh.h>
#include <packet/ray.h>
#include <packet/scene.h>
#include <packet/trace.h>
#include <packet/version.h>
