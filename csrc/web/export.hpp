// Functions that JavaScript can call by their name.
#pragma once

#define TOUCHDOWN_EXPORT(name) extern "C" __attribute__((export_name(#name)))
