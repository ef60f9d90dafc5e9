/** Gait diagram: stance phases of all feet over time. */

import { useMemo, useRef } from 'preact/hooks'
import { ChartCard } from '../../charts/chart-card'
import { linearTicks } from '../../charts/scale'
import { Table } from '../../components/table/table'
import { useVisible } from '../../components/use-visible'
import { formatExact, formatNumber, quantity } from '../../format/number'
import { inWords } from '../../format/words'
import { type Playback, usePlayback } from '../player/playback'
import { type Recorded, stances } from '../replay/replay'

interface Row {
  readonly key: string
  readonly leg: string
  readonly walk: number
  readonly label: string
  readonly spans: readonly (readonly [number, number])[]
  /** Share of the time in stance. */
  readonly share: number
}

export function GaitChart({ walks, playback }: { walks: readonly Recorded[]; playback: Playback }) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const { time } = usePlayback(playback, 60, visible)
  const rows = useMemo(() => rowsOf(walks), [walks])
  const end = playback.duration || 1
  const place = (moment: number) => `${(100 * moment) / end}%`
  return (
    <div class="plot" ref={box}>
      <ChartCard
        title="Gait diagram"
        note="Bars show stance phases."
        table={() => <GaitTable rows={rows} comparing={walks.length > 1} />}
      >
        {/* Keyboard users can seek with the replay's slider. */}
        <div
          class="gait"
          role="img"
          aria-label="Stance phases of the feet; the table lists the times"
        >
          {rows.map((row) => (
            <div class="gait-row" key={row.key}>
              <span class="gait-leg">{row.walk === 0 ? row.leg : ''}</span>
              {/* biome-ignore lint/a11y/noStaticElementInteractions: the slider is for keyboards */}
              {/* biome-ignore lint/a11y/useKeyWithClickEvents: the slider is for keyboards */}
              <span
                class="gait-bars"
                onClick={(event) => {
                  const { left, width } = event.currentTarget.getBoundingClientRect()
                  playback.seek(((event.clientX - left) / width) * end)
                }}
              >
                {row.spans.map(([from, to]) => (
                  <i
                    key={from}
                    class={`walk-${row.walk + 1}`}
                    style={{ left: place(from), width: place(to - from) }}
                  />
                ))}
                <b style={{ left: place(time) }} />
              </span>
            </div>
          ))}
          <div class="gait-row">
            <span class="gait-leg">time [s]</span>
            <span class="gait-ticks">
              {linearTicks(0, end, 5).map((tick) => (
                <span key={tick} style={{ left: place(tick) }}>
                  {formatExact(tick, 3)}
                </span>
              ))}
            </span>
          </div>
        </div>
      </ChartCard>
    </div>
  )
}

function GaitTable({ rows, comparing }: { rows: readonly Row[]; comparing: boolean }) {
  const text = (spans: Row['spans']) =>
    spans.map(([from, to]) => `${formatNumber(from, 3)} to ${quantity(to, 's', 3)}`).join('; ')
  return (
    <Table<Row>
      caption="Stance phases"
      rows={rows}
      columns={[
        { key: 'leg', header: true, value: ({ leg }) => leg },
        ...(comparing ? [{ key: 'walk', value: ({ label }: Row) => label }] : []),
        { key: 'duty factor', percent: 3, value: ({ share }) => share },
        {
          key: 'stance phases',
          data: ({ spans }) => spans.map((span) => span.join(' to ')).join('; '),
          cell: ({ spans }) => text(spans),
        },
      ]}
    />
  )
}

/** Legs in the robot's order; walks of the same leg are adjacent. */
function rowsOf(walks: readonly Recorded[]): Row[] {
  const { legs } = walks[0].replay.header.robot
  return legs.flatMap((leg, k) =>
    walks.map(({ replay, label }, walk) => {
      const spans = stances(replay, k)
      const stood = spans.reduce((sum, [from, to]) => sum + to - from, 0)
      const share = replay.end > 0 ? stood / replay.end : 0
      return { key: `${leg} ${walk}`, leg: inWords(leg), walk, label, spans, share }
    }),
  )
}
