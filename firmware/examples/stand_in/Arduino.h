// Names of the Arduino core for ESP32 that the example uses, so that a plain compiler can check its types. No behaviour.
#pragma once

#include <cstddef>
#include <cstdint>

constexpr int INPUT_PULLUP = 5;
constexpr int LOW = 0;

void pinMode(int pin, int mode);
int digitalRead(int pin);
std::uint32_t micros();

struct HardwareSerial {
    std::size_t setRxBufferSize(std::size_t size);
    std::size_t setTxBufferSize(std::size_t size);
    void begin(unsigned long baud);
    int available();
    int availableForWrite();
    std::size_t readBytes(std::uint8_t* buffer, std::size_t length);
    std::size_t write(const std::uint8_t* buffer, std::size_t length);
};
extern HardwareSerial Serial;

struct EspClass {
    std::uint64_t getEfuseMac();
};
extern EspClass ESP;

// FreeRTOS, which the core includes.
using BaseType_t = int;
using UBaseType_t = unsigned int;
using TickType_t = std::uint32_t;
struct tskTaskControlBlock;
using TaskHandle_t = tskTaskControlBlock*;
using TaskFunction_t = void (*)(void*);
constexpr UBaseType_t configMAX_PRIORITIES = 25;
constexpr BaseType_t pdTRUE = 1;
constexpr TickType_t portMAX_DELAY = 0xFFFFFFFFU;
BaseType_t xTaskCreatePinnedToCore(TaskFunction_t task, const char* name, std::uint32_t stack, void* parameter,
                                   UBaseType_t priority, TaskHandle_t* handle, BaseType_t core);
BaseType_t xTaskNotifyGive(TaskHandle_t task);
std::uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t wait);
void vTaskDelay(TickType_t ticks);
