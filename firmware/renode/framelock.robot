*** Comments ***
renode-test firmware/renode/framelock.robot

*** Variables ***
${FRAMES}                         ${TEMPDIR}/framelock-frames.bin

*** Keywords ***
Create The Board
    Execute Command               include @${CURDIR}/framelock.resc
    Create Log Tester             0

Send A Hundred Frames
    # Pitch 200, roll 50, yaw 128, a hundred times: 61 ms.
    Evaluate                      open($FRAMES, "wb").write(100 * bytes([65, 66, 0, 200, 50, 128, 13]))
    Execute Command               play "${FRAMES}"

*** Test Cases ***
Should Park The Servos
    Create The Board
    Start Emulation
    Wait For Log Entry            pwm0: pulses of 1501 1501 1501 us    timeout=0.1

Should Follow The Frames
    Create The Board
    Execute Command               emulation RunFor "0.05"
    FOR    ${n}    IN RANGE    5
        Send A Hundred Frames
        Execute Command           emulation RunFor "0.09"
    END
    ${counters}=                  Execute Command    counters
    Should Contain                ${counters}    bytes 3500 frames 500
    Should Contain                ${counters}    idle
    Should Not Contain            ${counters}    no_sync
    Wait For Log Entry            pwm0: pulses of 1784 1196 1501 us    timeout=0.1
    # Silence: the failsafe holds, then parks the servos.
    Wait For Log Entry            pwm0: pulses of 1501 1501 1501 us    timeout=1.5

Should Be Reset By The Watchdog And Continue With The Same Pulses
    Create The Board
    Execute Command               emulation RunFor "0.05"
    FOR    ${n}    IN RANGE    5
        Send A Hundred Frames
        Execute Command           emulation RunFor "0.09"
    END
    # The clock stands still (TIMER0 TASKS_STOP), so no tick wakes the main loop, and nobody feeds the watchdog.
    Execute Command               sysbus WriteDoubleWord 0x40008004 1
    Start Emulation
    Wait For Log Entry            Reseting machine    timeout=0.3
    Wait For Log Entry            pwm0: pulses of 1784 1196 1501 us    timeout=0.1
