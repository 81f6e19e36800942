# The chain of stages: only wiring. Every rule calls `python -m pipeline`; what a job depends on
# stands in its params (the validated inputs and a hash of the code it runs), so that exactly the
# affected jobs run again. Outputs go to runs/STUDY/; the folder results/ is Python code.

from pipeline.wiring import resolve

if not config:

    configfile: "config/quick.yaml"


plan, study = resolve(config, workflow.configfiles)


wildcard_constraints:
    id="[A-Za-z0-9.=_+-]+",


localrules:
    collect,
    compare,
    ledger,
    pictures,
    report,


rule all:
    input:
        plan.folder / "report.html",
        plan.folder / "study.h5",


rule mesh:
    output:
        ensure(plan.folder / "meshes/{id}.msh", non_empty=True),
    log:
        plan.folder / "logs/mesh/{id}.log",
    benchmark:
        plan.folder / "benchmarks/mesh/{id}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=5,
    params:
        study=study,
        job=lambda w: plan.jobs["mesh"][w.id].params,
    shell:
        "python -m pipeline mesh {params.study} {wildcards.id:q} -o {output:q} > {log:q} 2>&1"


rule lab:
    input:
        lambda w: plan.jobs["lab"][w.id].inputs,
    output:
        ensure(plan.folder / "lab/{id}.vtkhdf", non_empty=True),
    log:
        plan.folder / "logs/lab/{id}.log",
    benchmark:
        plan.folder / "benchmarks/lab/{id}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=5,
    params:
        study=study,
        job=lambda w: plan.jobs["lab"][w.id].params,
    shell:
        "python -m pipeline lab {params.study} {wildcards.id:q} -o {output:q} > {log:q} 2>&1"


rule fea:
    input:
        lambda w: plan.jobs["fea"][w.id].inputs,
    output:
        ensure(plan.folder / "fea/{id}.vtkhdf", non_empty=True),
    log:
        plan.folder / "logs/fea/{id}.log",
    benchmark:
        plan.folder / "benchmarks/fea/{id}.tsv"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=15,
    params:
        study=study,
        job=lambda w: plan.jobs["fea"][w.id].params,
    shell:
        "python -m pipeline fea {params.study} {wildcards.id:q} -o {output:q} > {log:q} 2>&1"


rule prb:
    input:
        lambda w: plan.jobs["prb"][w.id].inputs,
    output:
        ensure(plan.folder / "prb/{id}.vtkhdf", non_empty=True),
    log:
        plan.folder / "logs/prb/{id}.log",
    benchmark:
        plan.folder / "benchmarks/prb/{id}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=5,
    params:
        study=study,
        job=lambda w: plan.jobs["prb"][w.id].params,
    shell:
        "python -m pipeline prb {params.study} {wildcards.id:q} -o {output:q} > {log:q} 2>&1"


rule fit:
    input:
        lambda w: plan.jobs["fit"][w.id].inputs,
    output:
        ensure(plan.folder / "fits/{id}.json", non_empty=True),
    log:
        plan.folder / "logs/fit/{id}.log",
    benchmark:
        plan.folder / "benchmarks/fit/{id}.tsv"
    # Others wait for fits.
    priority: 10
    threads: 1
    resources:
        mem_mb=1500,
        runtime=30,
    params:
        study=study,
        job=lambda w: plan.jobs["fit"][w.id].params,
    shell:
        "python -m pipeline fit {params.study} {wildcards.id:q} -o {output:q} --threads {threads} > {log:q} 2>&1"


rule collect:
    input:
        plan.outputs("lab"),
        plan.outputs("fea"),
        plan.outputs("prb"),
        plan.outputs("fit"),
    output:
        ensure(plan.folder / "study.h5", non_empty=True),
    log:
        plan.folder / "logs/collect.log",
    params:
        study=study,
        job=plan.whole(
            "results.collection",
            "results.store",
            "pipeline.stages.collect",
            "pipeline.stages.gather",
        ),
    shell:
        "python -m pipeline collect {params.study} > {log:q} 2>&1"


rule compare:
    input:
        plan.outputs("lab"),
        plan.outputs("fea"),
        plan.outputs("prb"),
        plan.outputs("fit"),
        plan.own_lab_files(),
    output:
        plan.folder / "accuracy.csv",
        plan.folder / "accuracy.md",
        plan.folder / "holes.json",
        plan.folder / "tables.json",
    log:
        plan.folder / "logs/compare.log",
    params:
        study=study,
        job=plan.whole(
            "lab",
            "results.accuracy",
            "results.fit_tables",
            "results.summary",
            "results.tables",
            "pipeline.stages.compare",
            "pipeline.stages.gather",
        ),
    shell:
        "python -m pipeline compare {params.study} > {log:q} 2>&1"


rule ledger:
    input:
        plan.outputs("lab"),
        plan.outputs("fea"),
        plan.outputs("prb"),
        plan.outputs("fit"),
        plan.own_lab_files(),
    output:
        plan.folder / "ledger.csv",
        plan.folder / "ledger.json",
        plan.folder / "ledger.md",
    log:
        plan.folder / "logs/ledger.log",
    params:
        study=study,
        job=plan.whole(
            "lab",
            "results.ledger",
            "results.accuracy",
            "pipeline.stages.compare",
            "pipeline.stages.gather",
            "pipeline.stages.ledger",
        ),
    shell:
        "python -m pipeline ledger {params.study} > {log:q} 2>&1"


rule pictures:
    input:
        plan.outputs("lab"),
        plan.outputs("fea"),
        plan.outputs("prb"),
        plan.outputs("fit"),
        plan.own_lab_files(),
    output:
        plan.folder / "pictures/index.json",
    log:
        plan.folder / "logs/pictures.log",
    params:
        study=study,
        job=plan.whole(
            "results.figures",
            "results.scenes",
            "pipeline.stages.pictures",
            "pipeline.stages.gather",
        ),
    shell:
        "python -m pipeline pictures {params.study} > {log:q} 2>&1"


rule report:
    input:
        rules.compare.output,
        rules.ledger.output,
        rules.pictures.output,
        rules.collect.output,
    output:
        plan.folder / "report.html",
    log:
        plan.folder / "logs/report.log",
    params:
        study=study,
        job=plan.whole("results", "pipeline.stages.report"),
    shell:
        "python -m pipeline report {params.study} > {log:q} 2>&1"
