/* Linear timecode by libltc, another implementation.
 *
 *   ltc_judge day FPS                    10 bytes of each frame of 24 hours from 00:00:00:00
 *   ltc_judge sound FPS H M S F COUNT    COUNT frames as WAV, 48,000 samples of 8 bits a second
 *   ltc_judge hear FPS < FILE.wav        each frame: hours minutes seconds frames, whether drop-frame, first sample
 *
 * The sound of `hear` has 48,000 samples of 16 bits a second in one channel, after a header of 44 bytes. 29.97 is drop-frame.
 */
#include <ltc.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RATE = 48000, HEADER = 44, BLOCK = 1024 };

static enum LTC_TV_STANDARD standard(double fps) {
    return fps == 25 ? LTC_TV_625_50 : fps == 24 ? LTC_TV_FILM_24 : LTC_TV_525_60;
}

static LTCEncoder *encoder_at(double fps, const int *clock) {
    LTCEncoder *encoder = ltc_encoder_create(RATE, fps, standard(fps), 0);
    SMPTETimecode time;
    memset(&time, 0, sizeof time);
    strcpy(time.timezone, "+0000");
    time.hours = (unsigned char)clock[0];
    time.mins = (unsigned char)clock[1];
    time.secs = (unsigned char)clock[2];
    time.frame = (unsigned char)clock[3];
    ltc_encoder_set_timecode(encoder, &time);
    return encoder;
}

static int day(double fps) {
    const int midnight[4] = {0, 0, 0, 0};
    LTCEncoder *encoder = encoder_at(fps, midnight);
    int is_next_day;
    do {
        LTCFrame frame;
        ltc_encoder_get_frame(encoder, &frame);
        fwrite(&frame, 10, 1, stdout);
        is_next_day = ltc_encoder_inc_timecode(encoder);
    } while (!is_next_day);
    ltc_encoder_free(encoder);
    return 0;
}

static void put(uint32_t number, int bytes) {
    for (; bytes > 0; bytes--, number >>= 8)
        putchar((int)(number & 0xff));
}

static int sound(double fps, const int *clock, int count) {
    LTCEncoder *encoder = encoder_at(fps, clock);
    fputs("RIFF", stdout);
    put(UINT32_MAX, 4);
    fputs("WAVEfmt ", stdout);
    put(16, 4);
    put(1, 2);
    put(1, 2);
    put(RATE, 4);
    put(RATE, 4);
    put(1, 2);
    put(8, 2);
    fputs("data", stdout);
    put(UINT32_MAX, 4);
    for (; count > 0; count--) {
        ltcsnd_sample_t *samples;
        ltc_encoder_encode_frame(encoder);
        int length = ltc_encoder_get_bufferptr(encoder, &samples, 1);
        fwrite(samples, (size_t)length, 1, stdout);
        ltc_encoder_inc_timecode(encoder);
    }
    ltc_encoder_free(encoder);
    return 0;
}

static int hear(double fps) {
    LTCDecoder *decoder = ltc_decoder_create((int)(RATE / fps), 64);
    char header[HEADER];
    short samples[BLOCK];
    size_t length;
    ltc_off_t position = 0;
    if (fread(header, HEADER, 1, stdin) != 1)
        return 1;
    while ((length = fread(samples, sizeof *samples, BLOCK, stdin)) > 0) {
        LTCFrameExt frame;
        ltc_decoder_write_s16(decoder, samples, length, position);
        position += (ltc_off_t)length;
        while (ltc_decoder_read(decoder, &frame)) {
            SMPTETimecode time;
            ltc_frame_to_time(&time, &frame.ltc, 0);
            printf("%d %d %d %d %d %lld\n", time.hours, time.mins, time.secs, time.frame, frame.ltc.dfbit,
                   (long long)frame.off_start);
        }
    }
    ltc_decoder_free(decoder);
    return 0;
}

int main(int argc, char **argv) {
    if (argc < 3)
        return 2;
    double fps = atof(argv[2]);
    if (strcmp(argv[1], "day") == 0)
        return day(fps);
    if (strcmp(argv[1], "hear") == 0)
        return hear(fps);
    if (strcmp(argv[1], "sound") == 0 && argc == 8) {
        int clock[4];
        for (int index = 0; index < 4; index++)
            clock[index] = atoi(argv[3 + index]);
        return sound(fps, clock, atoi(argv[7]));
    }
    return 2;
}
