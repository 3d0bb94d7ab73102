-- robot_status.lua: the autopilot itself reports its emergency stop.
--
-- For ArduPilot, tested with 4.5.6. Copy this file to APM/scripts on the SD card, set SCR_ENABLE to 1 and reboot.
-- It sends NAMED_VALUE_FLOAT RS_STOP on every link, once a second and within 50 ms of a change. The value is the sum of
--   1  the motor emergency stop is engaged
--   2  the safety switch is on safe
-- mav-robot-status reads it. The script only reads: it never changes an output, a parameter or a mode.
--
-- Part of mav-robot-status. Apache-2.0.

local STOPPED, SAFE = 1, 2
local PERIOD = 25 -- ms between two readings: half of 50 ms, because the scheduler may be late
local REPEAT = 40 -- readings without a change until the next message: 1 s

local sent -- the value of the last message; nil before the first
local readings = 0 -- since the last message; counted, because millis() allocates an object in each call

local function update()
    local stopped, safe = SRV_Channels:get_emergency_stop(), SRV_Channels:get_safety_state()
    readings = readings + 1
    if stopped ~= nil and safe ~= nil then -- without an answer there is no message: nil does not mean released
        local value = (stopped and STOPPED or 0) + (safe and SAFE or 0)
        if value ~= sent or readings >= REPEAT then
            gcs:send_named_float("RS_STOP", value)
            sent, readings = value, 0
        end
    end
    return update, PERIOD
end

if not (SRV_Channels and SRV_Channels.get_emergency_stop and SRV_Channels.get_safety_state) then
    gcs:send_text(4, "robot_status.lua: firmware lacks its bindings") -- 4: WARNING
    return
end
return update()
