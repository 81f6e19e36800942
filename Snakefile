# The chain of stages: only wiring. Every rule calls `python -m pipeline`; what a job depends on
# stands in its params (the validated inputs and a hash of the code it runs), so that exactly the
# affected jobs run again. Outputs go to runs/STUDY/; the folder results/ is Python code.

from pipeline.wiring import resolve

if not config:

    configfile: "config/quick.yaml"


plan, study = resolve(config, workflow.configfiles)
answers = plan.outputs("lab", "fea", "prb", "fit")


wildcard_constraints:
    id="[A-Za-z0-9.=_+-]+",


localrules:
    collect,
    compare,
    ledger,
    pictures,
    report,


# The answers stand here too, since Snakemake looks for a lost file only where its target needs it.
rule all:
    input:
        plan.folder / "report.html",
        plan.folder / "study.h5",
        answers,


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
        mem_mb=2000,
        runtime=60,
    params:
        study=study,
        job=lambda w: plan.jobs["fea"][w.id].params,
    shell:
        "python -m pipeline fea {params.study} {wildcards.id:q} -o {output:q} > {log:q} 2>&1"


# A PRB sample takes less time than its process: one job makes many, and each still has its own file.
for batch in plan.batches.values():

    rule:
        name:
            f"prb_{batch.id}"
        input:
            batch.inputs,
        output:
            ensure(batch.outputs, non_empty=True),
        log:
            plan.folder / f"logs/prb/{batch.id}.log",
        benchmark:
            plan.folder / f"benchmarks/prb/{batch.id}.tsv"
        threads: 1
        resources:
            mem_mb=1000,
            runtime=30,
        params:
            study=study,
            batch=batch.id,
            samples=batch.digest,
        shell:
            "python -m pipeline prb {params.study} {params.batch:q} > {log:q} 2>&1"


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
        answers,
    output:
        ensure(plan.folder / "study.h5", non_empty=True),
    log:
        plan.folder / "logs/collect.log",
    params:
        study=study,
        job=plan.whole,
    shell:
        "python -m pipeline collect {params.study} > {log:q} 2>&1"


rule compare:
    input:
        answers,
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
        job=plan.whole,
    shell:
        "python -m pipeline compare {params.study} > {log:q} 2>&1"


rule ledger:
    input:
        answers,
        plan.own_lab_files(),
    output:
        plan.folder / "ledger.csv",
        plan.folder / "ledger.json",
        plan.folder / "ledger.md",
    log:
        plan.folder / "logs/ledger.log",
    params:
        study=study,
        job=plan.whole,
    shell:
        "python -m pipeline ledger {params.study} > {log:q} 2>&1"


rule pictures:
    input:
        answers,
        plan.own_lab_files(),
    output:
        plan.folder / "pictures/index.json",
    log:
        plan.folder / "logs/pictures.log",
    params:
        study=study,
        job=plan.whole,
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
        job=plan.whole,
    shell:
        "python -m pipeline report {params.study} > {log:q} 2>&1"
